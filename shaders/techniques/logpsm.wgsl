//!include map/warp/single.wgsl
//!include map/warp/logarithm.wgsl
//!include map/tiles.wgsl
// One map with a logarithm along the view.

var<uniform> shape_of_map: Shape;

fn shape() -> Shape {
    return shape_of_map;
}

var<storage, read_write> made_shape: Shape;
var<storage, read_write> made_view: LightView;

// f_w/n_w of the light's view, which may be narrowed to the receivers: a part of a logarithm is one again, with the same
// centre. Then the margin.
@compute @workgroup_size(1)
fn shape_of_view() {
    let v = light_view;
    // Along the perspective and across the light: what w gains there as y gains 1.
    let along = v.row_y.xyz - v.axis.xyz * dot(v.axis.xyz, v.row_y.xyz);
    // At 1 - 2e-5 f_w/n_w is 1e5.
    let h = clamp(dot(v.row_w.xyz, along) / dot(v.row_y.xyz, along), 0.0, 1.0 - 2e-5);
    let made = shaped(v, h);
    made_view = made.view;
    made_shape = made.shape;
}

fn inspect_warp(s: Surface) -> f32 {
    switch frame.map {
        case shows_gain: {
            return gain(s, light_view);
        }
        case shows_shadow_maps: {
            return maps_picture(s.pixel, 1u);
        }
        case shows_sides: {
            return select(-1.0, label(0u, 0.5), s.valid);
        }
        default: {
            return -1.0;
        }
    }
}
