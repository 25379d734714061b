//! What each switch of the plan saves, in processor time and in memory, and what all of them together do for scenes that need
//! little. `cargo xtask plan` prints it; nothing is asserted, since clocks are no proof.

mod common;

use antumbra::settings::{Anyway, Settings};
use antumbra::weld::Bake;
use common::planned::{
    all_scenes, boxes_in_the_sun, empty_room, floor_and_box, in_a_round_sun, rooms_in_a_row, rotunda,
};
use common::scene::{Scene, adaptive, arriving};
use cpu_time::ProcessTime;
use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Bakes of each kind, of which the fastest counts: other work on the machine only adds.
const BAKES: usize = 5;

/// What a bake takes.
#[derive(Clone, Copy)]
struct Taken {
    cpu_s: f64,
    peak_bytes: usize,
}

type Force = fn(&mut Anyway);

const SWITCHES: [(&str, Force); 8] = [
    ("reflection", |anyway| anyway.reflection = true),
    ("open_visibility", |anyway| anyway.open_visibility = true),
    ("outer_faces", |anyway| anyway.outer_faces = true),
    ("occlusion", |anyway| anyway.occlusion = true),
    ("shadow_lines", |anyway| anyway.shadow_lines = true),
    ("facing_away", |anyway| anyway.facing_away = true),
    ("screens", |anyway| anyway.screens = true),
    ("second_bounce", |anyway| anyway.second_bounce = true),
];

fn one_thread(mut settings: Settings) -> Settings {
    settings.threads = 1;
    settings.verify_points = 0;
    settings
}

fn take(scene: &Scene, settings: &Settings) -> (Taken, Bake) {
    MEMORY.reset_peak_usage();
    let before = MEMORY.current_usage();
    let start = ProcessTime::now();
    let bake = scene.bake(settings);
    let cpu_s = start.elapsed().as_secs_f64();
    (Taken { cpu_s, peak_bytes: MEMORY.peak_usage() - before }, bake)
}

/// A scene baked in two ways, in turns.
fn both(scene: &Scene, settings: &Settings, anyway: Anyway) -> ([Taken; 2], Bake) {
    let with = Settings { anyway, ..settings.clone() };
    let mut best: Option<[Taken; 2]> = None;
    let mut last = None;
    for _ in 0..BAKES {
        let (without, bake) = take(scene, settings);
        let (with, _) = take(scene, &with);
        let now = [without, with];
        best = Some(best.map_or(now, |best| {
            std::array::from_fn(|k| if now[k].cpu_s < best[k].cpu_s { now[k] } else { best[k] })
        }));
        last = Some(bake);
    }
    (best.expect("there are bakes"), last.expect("there are bakes"))
}

fn row(what: &str, [without, with]: [Taken; 2]) {
    let percent = |part: f64, whole: f64| 100.0 * (1.0 - part / whole);
    println!(
        "| {what} | {:.3} s | {:.3} s | {:.0} % | {:.0} % |",
        without.cpu_s,
        with.cpu_s,
        percent(without.cpu_s, with.cpu_s),
        percent(without.peak_bytes as f64, with.peak_bytes as f64)
    );
}

#[test]
#[ignore = "a measurement"]
fn what_each_switch_saves() {
    println!("| switch, scene | processor time | forced off | time saved | memory saved |");
    println!("| --- | --- | --- | --- | --- |");
    for (name, scene) in all_scenes() {
        let settings = one_thread(Settings { tolerance: 0.02, ..adaptive() });
        let (_, bake) = take(&scene, &settings);
        for (switch, force) in SWITCHES {
            if bake.report.result.plan.iter().any(|left_out| left_out.name == switch) {
                let mut anyway = Anyway::default();
                force(&mut anyway);
                row(&format!("`{switch}`, {name}"), both(&scene, &settings, anyway).0);
            }
        }
    }
}

#[test]
#[ignore = "a measurement"]
fn what_all_switches_save() {
    println!("| scene, all switches | processor time | forced off | time saved | memory saved |");
    println!("| --- | --- | --- | --- | --- |");
    let reflected = one_thread(Settings { tolerance: 0.02, ..adaptive() });
    let direct = arriving(reflected.clone());
    for (what, scene, settings) in [
        ("without shadows: a room of twenty walls", rotunda(), &reflected),
        ("without shadows: an empty room", empty_room(), &reflected),
        ("a lamp in each of six rooms", rooms_in_a_row(), &reflected),
        ("without second bounce: black floor and box", floor_and_box(0.0, 0.0), &direct),
        ("without second bounce: dark floor and box", floor_and_box(0.001, 0.001), &reflected),
        ("a sun alone: boxes that reflect 0.3", boxes_in_the_sun(0.3), &reflected),
        ("a sun alone: black boxes", boxes_in_the_sun(0.0), &direct),
        ("a round sun alone: boxes that reflect 0.3", in_a_round_sun(boxes_in_the_sun(0.3)), &reflected),
        ("a round sun alone: black boxes", in_a_round_sun(boxes_in_the_sun(0.0)), &direct),
    ] {
        let (taken, bake) = both(&scene, settings, Anyway::EVERYTHING);
        let names: Vec<&str> = bake.report.result.plan.iter().map(|left_out| left_out.name).collect();
        row(&format!("{what} ({})", names.join(", ")), taken);
    }
}
