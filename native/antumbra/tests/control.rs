//! Watching, stopping and cancelling a bake.

mod common;

use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use antumbra::Error;
use antumbra::monitor::{Monitor, Progress, Stage};
use antumbra::settings::{Method, Settings, Transport};
use antumbra::solve::bake;
use antumbra::weld::Bake;
use common::baked::assert_sound;
use common::scene::{Scene, adaptive, lamp, uniform};
use common::shape::Shape;
use glam::DVec3;

/// A room with many things in it: seconds of work at fine settings.
fn room() -> Scene {
    let mut scene = Scene::default();
    let grey = scene.material(0.7, 0.0);
    scene.object("room", Shape::room(DVec3::new(4.0, 3.0, 2.5)), grey);
    for i in 0..4 {
        let centre = DVec3::new(0.6 + 0.8 * f64::from(i), 1.5, 0.5);
        scene.object("ball", Shape::sphere(0.3, 2).map(|p| p + centre), grey);
    }
    scene.light(&lamp(DVec3::new(2.0, 1.5, 2.4), 0.3), 10.0);
    scene
}

const METHODS: [Method; 3] = [Method::Adm, Method::Dm, Method::As];

/// So much work that it cannot be done before the test cancels it.
fn endless() -> Settings {
    Settings { tolerance: 1e-4, element_size: 0.05, ..adaptive() }
}

fn quick() -> Settings {
    Settings { tolerance: 0.2, max_level: 2, transport: Transport::Shooting, ..adaptive() }
}

const TRANSPORTS: [Transport; 2] = [Transport::Shooting, Transport::Hierarchical];
const ALL_TRANSPORTS: [Transport; 3] = [Transport::Shooting, Transport::Hierarchical, Transport::Rays];

/// Bakes on one thread while `watch` sees every snapshot that another thread catches.
fn watched(settings: &Settings, mut watch: impl FnMut(&Monitor, Progress)) -> (Result<Bake, Error>, Monitor) {
    let (scene, monitor, finished) = (room(), Monitor::new(), AtomicBool::new(false));
    let result = thread::scope(|scope| {
        let worker = scope.spawn(|| {
            let result = bake(&scene.input, settings, &monitor);
            finished.store(true, Ordering::Release);
            result
        });
        while !finished.load(Ordering::Acquire) {
            watch(&monitor, monitor.progress());
            thread::yield_now();
        }
        worker.join().expect("the solver does not panic")
    });
    (result, monitor)
}

#[test]
fn cancelled_before_it_starts() {
    let monitor = Monitor::new();
    monitor.cancel();
    assert_eq!(bake(&room().input, &endless(), &monitor).err(), Some(Error::Cancelled));
}

#[test]
fn cancelled_while_it_shoots() {
    for method in METHODS {
        let (result, _) = watched(&Settings { method, ..quick() }, |monitor, progress| {
            if progress.stage == Stage::Shooting && progress.shots >= 2 {
                monitor.cancel();
            }
        });
        assert_eq!(result.err(), Some(Error::Cancelled));
    }
}

#[test]
fn cancelled_before_its_first_shot() {
    for method in METHODS {
        let (result, _) = watched(&Settings { method, ..endless() }, |monitor, _| monitor.cancel());
        assert_eq!(result.err(), Some(Error::Cancelled));
    }
}

/// Whoever cancels after stopping, or stops after cancelling, has cancelled.
#[test]
fn cancelling_is_final() {
    for order in [[Monitor::stop, Monitor::cancel], [Monitor::cancel, Monitor::stop]] {
        let monitor = Monitor::new();
        for wish in order {
            wish(&monitor);
        }
        assert_eq!(bake(&room().input, &quick(), &monitor).err(), Some(Error::Cancelled));
    }
}

#[test]
fn stopped_before_its_first_shot_it_is_still_a_bake() {
    let (scene, monitor) = (room(), Monitor::new());
    monitor.stop();
    let stopped = bake(&scene.input, &quick(), &monitor).expect("stopping is no failure");
    assert_eq!(stopped.report.result.ended_by, "stopped");
    assert_sound(&scene.input, &stopped);
    assert_eq!(stopped.meshes.len(), 5);
    assert_eq!(monitor.progress().stage, Stage::Done);
    assert_eq!(monitor.progress().fraction, 1.0);
}

#[test]
fn stopped_while_it_shoots_it_has_some_light() {
    let settings = Settings { tolerance: 1e-3, max_level: 2, transport: Transport::Shooting, ..adaptive() };
    let (result, _) = watched(&settings, |monitor, progress| {
        if progress.shots >= 5 {
            monitor.stop();
        }
    });
    let stopped = result.expect("stopping is no failure");
    assert_eq!(stopped.report.result.ended_by, "stopped");
    assert!(stopped.report.result.unshot > 0.0);
    assert_sound(&room().input, &stopped);
    assert!(common::baked::all_light(&stopped).any(|light| light.min_element() > 0.1));
}

/// Light is not waited for at every vertex: where nobody looked, a vertex has that of its patch, and the report says so.
#[test]
fn stopped_before_light_was_looked_for_all_is_lit_by_patches() {
    let settings = Settings { transport: Transport::Rays, ..endless() };
    let (result, _) = watched(&settings, |monitor, progress| {
        if !matches!(progress.stage, Stage::Preparing | Stage::Linking) {
            monitor.stop();
        }
    });
    let stopped = result.expect("stopping is no failure");
    assert_eq!(stopped.report.result.ended_by, "stopped");
    assert_sound(&room().input, &stopped);
    assert!(stopped.report.warnings.iter().any(|warning| warning.contains("what their patches get")));
    // Nothing in the room lies in the dark; without what is reflected, the ceiling around the lamp would.
    let light: Vec<f64> = common::baked::all_light(&stopped).map(DVec3::min_element).collect();
    let mean = light.iter().sum::<f64>() / light.len() as f64;
    let darkest = light.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(darkest > 0.02 * mean, "{darkest} where the mean is {mean}");
}

#[test]
fn a_time_limit_ends_it() {
    let scene = room();
    for (method, transport) in METHODS.into_iter().flat_map(|method| ALL_TRANSPORTS.map(|way| (method, way)))
    {
        let settings = Settings { method, transport, ..quick() };
        let bake = scene.bake(&Settings { time_limit: 1e-9, ..settings.clone() });
        assert_eq!(bake.report.result.ended_by, "time_limit");
        assert_sound(&scene.input, &bake);
        let bake = scene.bake(&Settings { time_limit: 1e6, ..settings });
        assert_eq!(bake.report.result.ended_by, "converged");
    }
}

#[test]
fn progress_never_goes_back_and_ends_at_1() {
    let linked = Settings { transport: Transport::Hierarchical, ..quick() };
    for settings in [quick(), linked, uniform(0.5)] {
        let (mut last, mut seen) = (Progress::default(), 0);
        let (result, monitor) = watched(&settings, |_, progress| {
            assert!((0.0..=1.0).contains(&progress.fraction), "{progress:?}");
            let (before, now) = (last.fraction, progress.fraction);
            assert!(now >= before, "from {last:?} back to {progress:?}");
            assert!(progress.shots >= last.shots && progress.stage as u8 >= last.stage as u8);
            seen += usize::from(progress != last);
            last = progress;
        });
        assert!(result.is_ok() && seen > 3, "only {seen} snapshots");
        assert_eq!(monitor.progress().stage, Stage::Done);
        assert_eq!(monitor.progress().fraction, 1.0);
    }
}

#[test]
fn the_timeline_goes_forward() {
    for transport in TRANSPORTS {
        let report = room().bake(&Settings { transport, ..quick() }).report;
        assert!(!report.timeline.is_empty());
        for pair in report.timeline.windows(2) {
            assert!(pair[0].time_s <= pair[1].time_s);
            assert!(pair[0].shots <= pair[1].shots);
            assert!(pair[0].elements <= pair[1].elements && pair[0].vertices <= pair[1].vertices);
            assert!((0.0..=1.0).contains(&pair[1].unshot));
        }
        let last = report.timeline.last().expect("it is not empty");
        assert!(report.timeline[0].unshot > 0.0 && last.unshot < report.timeline[0].unshot);
        assert!(last.shots > 1 || transport == Transport::Hierarchical);
    }
}

/// The mesh only grows, and what is shown is what a bake would be if it ended there.
#[test]
fn who_watches_sees_the_mesh_refine_and_brighten() {
    for transport in [Transport::Hierarchical, Transport::Rays, Transport::Shooting] {
        let mut seen: Vec<(usize, f64)> = Vec::new();
        let settings = Settings { transport, ..quick() };
        let (result, _) = watched(&settings, |monitor, _| {
            let Some(meshes) = monitor.preview() else { return };
            assert_eq!(meshes.len(), 5);
            let triangles = meshes.iter().map(|mesh| mesh.triangles.len()).sum();
            let colours = meshes.iter().flat_map(|mesh| mesh.corner_radiance.iter().flatten());
            let brightest = colours.flatten().fold(0.0, |most, &value| f64::max(most, f64::from(value)));
            assert!(brightest.is_finite());
            seen.push((triangles, brightest));
        });
        let bake = result.expect("watching changes nothing");
        assert!(!seen.is_empty(), "{transport:?}");
        assert!(seen.is_sorted_by_key(|&(triangles, _)| triangles), "{transport:?}: {seen:?}");
        assert!(seen.iter().all(|&(triangles, _)| triangles <= bake.report.result.triangles));
        assert!(seen.iter().any(|&(_, brightest)| brightest > 0.0));
    }
}

#[test]
fn watching_changes_nothing_and_who_does_not_ask_gets_nothing() {
    let (result, _) = watched(&quick(), |monitor, _| drop(monitor.preview()));
    let monitor = Monitor::new();
    let unwatched = bake(&room().input, &quick(), &monitor).expect("it is a good scene");
    assert!(monitor.preview().is_none());
    let watched = result.expect("it is a good scene");
    for (a, b) in watched.meshes.iter().zip(&unwatched.meshes) {
        assert_eq!(a.corner_radiance, b.corner_radiance);
    }
}
