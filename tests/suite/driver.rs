//! Drivers that lack something, refuse something, or go away: what is told, and what goes on.

use crate::common::*;
use glam::Vec3;
use shadowscope::frame::{Ask, Renderer, Truth};
use shadowscope::gpu::{self, Failure, Gpu, Need, Shaders, Timer, TimerMode};
use shadowscope::light::Light;
use shadowscope::measure::{self, Step};
use shadowscope::scene::Scene;
use shadowscope::{message, techniques};
use std::process::Command;
use std::sync::Arc;
use std::sync::atomic::{AtomicU32, Ordering};

fn over_the_yard(light: Light) -> Scene {
    scene(vec![mesh(&yard(), 0)], vec![material(Vec3::ONE)], camera(Vec3::new(4.0, 6.0, 7.0), Vec3::ZERO), light)
}

/// A device of its own, that a test may lose.
fn own_device() -> Arc<Gpu> {
    Arc::new(Gpu::new(None).unwrap())
}

/// Without a driver each command says what to install, and fails.
#[test]
fn no_adapter_is_a_sentence() {
    let folder = tempfile::tempdir().unwrap();
    for args in [
        &["capture", "cubes", "--size", "32x32", "-o", "a.png"][..],
        &["measure", "cubes", "--size", "32x32", "--techniques", "shadow-map"],
        &["list", "adapters"],
    ] {
        let mut command = Command::new(env!("CARGO_BIN_EXE_shadowscope"));
        command.args(args).current_dir(&folder).env("VK_DRIVER_FILES", "/nonexistent").env_remove("VK_ICD_FILENAMES");
        let out = command.output().unwrap();
        let told = String::from_utf8(out.stderr).unwrap();
        let last = told.lines().last().unwrap_or_default();
        assert!(!out.status.success() && last.contains("no graphics adapter was found; install a driver"), "{told}");
        assert!(!told.contains("panicked") && !folder.path().join("a.png").exists(), "{told}");
    }
}

/// A device that is lost between two passes of a frame fails that frame and all that follow, whatever they ask; another one draws the
/// same picture as ever.
#[test]
fn a_device_lost_mid_frame_is_told() {
    let scene = Arc::new(over_the_yard(sun(Vec3::new(0.4, 0.8, 0.3))));
    let (mut whole, mut s) = start((*scene).clone(), [64, 48]);
    select(&mut s, "pcf", &["resolution=256"]);
    let ask = Ask { truth: Truth::All, ..ask(&s) };
    whole.render(&s, ask).unwrap();
    let right = whole.read_visibility().unwrap();
    for pass in [0, 2, 4] {
        let gpu = own_device();
        let mut r = Renderer::new(gpu.clone(), scene.clone()).unwrap();
        let (asked, device) = (AtomicU32::new(0), gpu.device.clone());
        gpu.give_up_when(move || {
            if asked.fetch_add(1, Ordering::Relaxed) == pass {
                device.destroy();
            }
            false
        });
        let error = r.render(&s, ask).expect_err("the device is gone");
        assert!(Failure::is_loss(&error), "{pass}: {error:#}");
        let told = message::sentence(&error);
        assert!(told.starts_with("the graphics driver has dropped its device") && told.contains("--adapter"), "{told}");
        for error in [
            r.render(&s, ask).err(),
            r.redraw(&s).err(),
            r.read_visibility().err(),
            r.trace(64).err(),
            Renderer::new(gpu.clone(), scene.clone()).err(),
            gpu.check().err(),
        ] {
            let error = error.unwrap_or_else(|| panic!("{pass}: nothing is told"));
            assert!(Failure::is_loss(&error), "{pass}: {error:#}");
        }
        let mut again = Renderer::new(own_device(), scene.clone()).unwrap();
        again.render(&s, ask).unwrap();
        assert!(again.read_visibility().unwrap() == right, "{pass}");
    }
}

/// A sweep on a device that is lost ends there: what is measured has been handed in, and no configuration is blamed.
#[test]
fn a_sweep_ends_with_its_device() {
    let scene = over_the_yard(sun(Vec3::new(0.4, 0.8, 0.3)));
    let (_, s) = start(scene.clone(), [32, 24]);
    let mut r = Renderer::new(own_device(), Arc::new(scene)).unwrap();
    let work: Vec<_> = (0..20u64)
        .map(|i| {
            let mut own = s.clone();
            select(&mut own, "shadow-map", &[&format!("resolution={}", 64 + i)]);
            (i, own)
        })
        .collect();
    let device = r.gpu.device.clone();
    let (mut rows, mut blamed) = (0, Vec::new());
    // Sixteen take turns; the seventeenth finds no device.
    let ended = measure::run(&mut r, &s, &work, work.len() as u64, Default::default(), &mut |step| {
        match step {
            Step::Row(_) => {
                rows += 1;
                if rows == 16 {
                    device.destroy();
                }
            }
            Step::Failed(why) => blamed.push(why.to_string()),
            Step::Working(..) => {}
        }
        true
    });
    let error = ended.expect_err("the device is gone");
    assert!(Failure::is_loss(&error), "{error:#}");
    assert!(rows == 16 && blamed.is_empty(), "{rows} rows, {blamed:?}");
}

/// Maps that there is no memory for fail their configuration alone: the next one, on the same device, is measured as ever.
#[test]
#[cfg(target_os = "linux")]
fn used_up_memory_fails_one_configuration() {
    let folder = tempfile::tempdir().unwrap();
    let sweep = |file: &str, resolution: &str, memory: &str| {
        let program = env!("CARGO_BIN_EXE_shadowscope");
        let command = format!(
            "{memory} exec {program} sweep cubes --size 32x24 --light 'omni:position=0,3,0;range=60' --techniques cube \
             --set resolution={resolution} -o {file}"
        );
        let mut shell = Command::new("sh");
        shell.args(["-c", &command]).current_dir(&folder).env("SHADOWSCOPE_TIMING", "0");
        let out = shell.output().unwrap();
        (out.status.success(), String::from_utf8_lossy(&out.stderr).into_owned())
    };
    // Six faces of 8192² texels are 1.5 GiB.
    let (ok, told) = sweep("short.csv", "8192,64", "ulimit -v 2000000;");
    let last = told.lines().last().unwrap_or_default();
    assert!(!ok && last.contains("resolution=8192") && last.contains("its memory is used up; close other"), "{told}");
    let (ok, told) = sweep("whole.csv", "64", "");
    assert!(ok, "{told}");
    let rows = |file: &str| measure::read(&folder.path().join(file)).unwrap();
    let ([short], [whole]) = (&rows("short.csv")[..], &rows("whole.csv")[..]) else { panic!("one row each") };
    let found = |r: &measure::Record| (r.params.clone(), r.error_share, r.rmse, r.gpu_bytes);
    assert_eq!(found(short), found(whole));
}

/// A right shader that this driver makes no pipeline of fails its technique, by its name, each time it is asked for; the others are drawn
/// on the same device.
#[test]
fn a_shader_that_the_driver_refuses_is_told_with_its_technique() {
    let folder = tempfile::tempdir().unwrap();
    gpu::write_files(folder.path()).unwrap();
    let file = folder.path().join("techniques/psv.wgsl");
    let text = std::fs::read_to_string(&file).unwrap();
    let larger = text.replacen("@workgroup_size(8, 8)", "@workgroup_size(32, 32)", 1);
    assert_ne!(larger, text);
    std::fs::write(&file, larger).unwrap();
    let scene = over_the_yard(sun(Vec3::new(0.4, 0.8, 0.3)));
    let (mut whole, mut s) = start(scene.clone(), [48, 36]);
    let fewer = |f, l: wgpu::Limits| {
        let limits =
            wgpu::Limits { max_compute_invocations_per_workgroup: 256, max_compute_workgroup_size_x: 256, ..l };
        (f, limits)
    };
    let mut gpu = Gpu::within(&gpu::instance(), None, None, fewer).unwrap();
    gpu.shaders = Shaders::from_folder(folder.path());
    let mut r = Renderer::new(Arc::new(gpu), Arc::new(scene)).unwrap();
    for _ in 0..2 {
        select(&mut s, "psv", &[]);
        let told = message::sentence(&r.render(&s, ask(&s)).expect_err("1024 threads are too many"));
        let title = techniques::find("psv").unwrap().title;
        assert!(told.starts_with(&format!("{title} cannot be made: ")), "{told}");
        assert!(told.contains("techniques/psv.wgsl") && told.contains(&r.gpu.info.name), "{told}");
        select(&mut s, "shadow-map", &["resolution=256"]);
        r.render(&s, ask(&s)).unwrap();
        whole.render(&s, ask(&s)).unwrap();
        assert!(r.read_visibility().unwrap() == whole.read_visibility().unwrap());
    }
}

/// What an adapter lacks is known without drawing: techniques that it cannot run, and the options of those that it can.
#[test]
fn what_an_adapter_lacks_is_known_beforehand() {
    let all = (*gpu().abilities).clone();
    let least =
        gpu::Abilities { features: wgpu::Features::empty(), limits: wgpu::Limits::downlevel_defaults(), ..all.clone() };
    let why = |id: &str, on: &gpu::Abilities| techniques::find(id).unwrap().cannot_run(on);
    assert!(techniques::ALL.iter().all(|info| info.cannot_run(&all).is_none()));
    assert!(least.weak() && !all.weak());
    let told = why("csm-conservative", &least).unwrap();
    assert!(told.contains("it needs 7 storage buffers in one shader") && told.ends_with("has 4"), "{told}");
    assert!(why("imperfect-sm", &least).unwrap().contains("49152 bytes in a uniform buffer"));
    // Its exact raster alone needs them; of four numbers 16 bits each can be averaged, of two they cannot.
    assert_eq!((why("logpsm", &least), why("evsm", &least), why("pcf", &least)), (None, None, None));
    assert!(why("vsm", &least).unwrap().ends_with("choose another filter"));
    let takes = |id: &str, sets: &[&str], name: &str, option: &str| {
        let mut s = shadowscope::setup::Setup::new("test", &over_the_yard(sun(Vec3::Y))).unwrap();
        select(&mut s, id, sets);
        techniques::find(id).unwrap().cannot_take(s.values(), name, option, &least).is_none()
    };
    assert!(!takes("logpsm", &["raster=linear"], "raster", "exact") && takes("logpsm", &[], "raster", "linear"));
    assert!(!takes("evsm", &["precision=16"], "precision", "32") && takes("evsm", &[], "precision", "16"));
    // Its precision is chosen once the filter is.
    assert!(takes("pssm", &[], "filter", "evsm") && !takes("pssm", &[], "filter", "vsm"));
    assert_eq!(least.lacks(Need::StorageBuffers(4)), None);
}

/// What takes longest is submitted in bands of rows, and what is short together in pieces: the same pictures bit for bit.
#[test]
fn long_passes_are_cut() {
    let light = plate(Vec3::new(3.0, 7.0, 2.0), Vec3::ZERO, 0.3);
    let (mut whole, mut s) = start(over_the_yard(light), [100, 76]);
    let mut gpu = Gpu::new(None).unwrap();
    assert_eq!(gpu.longest, u64::MAX, "software has no watchdog");
    gpu.longest = 1 << 14;
    let mut cut = Renderer::new(Arc::new(gpu), whole.scene().clone()).unwrap();
    // As GPUs have it: nothing is waited for between passes.
    cut.timer = Timer::with(TimerMode::Stamps);
    let mut passes = 0;
    for (light, id, sets) in [
        (light, "backprojection", &["resolution=64"][..]),
        (light, "rt-soft", &["samples=16"]),
        (sun(Vec3::new(0.4, 0.8, 0.3)), "rt-hard", &[]),
        (sun(Vec3::new(0.4, 0.8, 0.3)), "psv", &[]),
        (sun(Vec3::new(0.4, 0.8, 0.3)), "shadow-volume", &[]),
        (sun(Vec3::new(0.4, 0.8, 0.3)), "shadow-volume", &["topology=multiplicity"]),
        (sun(Vec3::new(0.4, 0.8, 0.3)), "imperfect-sm", &["vpls=16", "points=256", "resolution=64"]),
    ] {
        s.light = light;
        select(&mut s, id, sets);
        let ask = Ask { truth: Truth::Off, ..ask(&s) };
        let draw = |r: &mut Renderer| {
            let told = r.render(&s, ask).unwrap_or_else(|e| panic!("{id} {sets:?}: {e:#}"));
            (r.read_visibility().unwrap(), r.read_picture().unwrap(), told.passes)
        };
        let (one, many) = (draw(&mut whole), draw(&mut cut));
        assert!(one.0 == many.0 && one.1 == many.1, "{id} {sets:?}");
        assert!(one.0.iter().any(|v| *v < 0.5) && many.2 >= one.2 + 2, "{id} {sets:?}: {} and {}", one.2, many.2);
        passes += many.2 - one.2;
    }
    println!("{passes} passes more");
}
