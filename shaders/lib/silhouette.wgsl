// Silhouette edges as `shaders/map/silhouettes.wgsl` lists them: two vertices, so that seen from the light the shadow lies on the
// left of the way from the first to the second; how often; and the edge's number.
var<storage, read> silhouettes: array<vec4u>;
