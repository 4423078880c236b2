//! Actors obey the laws of their world: objects stay where they are put, hands hold what they carry, standing feet do not slide.

use nalgebra::{Isometry3, Point3};

use super::people::skeleton::{self, Bone};
use super::*;
use crate::camera_path::CameraPath;
use crate::spec::parse;

fn actors(spec: &str) -> (Actors, WorldConfig) {
    let config = parse(spec).unwrap();
    let mut scene = Scene::new(config.scene, config.seed);
    let path = CameraPath::new(&config, &scene);
    (Actors::new(&mut scene, &config, &path), config)
}

/// Returns the route, the task and the poses of person `index`.
fn walker(actors: &Actors, index: usize) -> (&Person, &Route, Task) {
    let person = &actors.people[index];
    match &person.plan {
        Plan::Walk(route, task) => (person, route, *task),
        _ => unreachable!("person {index} does not walk"),
    }
}

fn distance(a: &Isometry3<f32>, b: &Isometry3<f32>) -> f32 {
    (a.translation.vector - b.translation.vector).norm()
}

#[test]
fn a_carried_object_is_in_both_hands_never_jumps_and_stays_where_it_was_put_until_it_is_fetched() {
    for (seed, (name, object)) in (1..4).flat_map(|seed| CarriedObject::ALL.map(|object| (seed, object))) {
        let (actors, _) = actors(&format!("walking_static?seed={seed}&people=2&carry=on&object={name}"));
        assert_eq!(CLASS_NAMES[actors.class(3) as usize], name);
        let grip = tasks::grip_m(object);
        let (person, route, task) = walker(&actors, 0);
        assert_eq!(task, Task::Carry(object));
        let dt = 1.0 / 30.0;
        let frames: Vec<_> = (0..4500)
            .map(|i| {
                let time = f64::from(i) * dt;
                let poses = person.poses(time);
                let carried = tasks::carried(object, route, &route.at(time), &poses);
                (carried, [0, 1].map(|side| skeleton::palm(&poses, &person.body.proportions, side)))
            })
            .collect();
        let (mut lifted, mut landed, mut rest_places) = (0, 0, Vec::<Isometry3<f32>>::new());
        for pair in frames.windows(2) {
            let (before, (now, palms)) = (&pair[0].0, &pair[1]);
            assert!(distance(before, now) < 0.08, "the {name} jumps by {} m", distance(before, now));
            // An exact comparison: a box slightly above the floor is being lifted and may move to the side.
            let on_floor = |pose: &Isometry3<f32>| pose.translation.z == 0.0;
            if !on_floor(now) {
                lifted += 1;
                for palm in palms {
                    let local = now.inverse() * Point3::from(*palm);
                    let gap = Vec3::new(local.x.abs(), local.y, local.z) - Vec3::from(grip);
                    assert!(gap.norm() < 0.03, "seed {seed}: a hand is at {local} of the {name} it carries");
                }
            } else if on_floor(before) {
                let slid = distance(before, now);
                assert!(slid == 0.0, "the {name} slides by {slid} m on the floor");
                landed += 1;
                if rest_places.iter().all(|place| distance(place, now) > 1e-4) {
                    rest_places.push(*now);
                }
            }
        }
        assert!(lifted > 300 && landed > 300, "carried for {lifted}, left for {landed} frames");
        assert_eq!(rest_places.len(), 2, "the {name} rests at two places");
    }
}

#[test]
fn a_pushed_chair_crosses_the_room_in_the_hands_of_its_pusher() {
    let (actors, _) = actors("walking_static?seed=5&people=1&chair=on");
    assert_eq!(CLASS_NAMES[actors.class(2) as usize], "chair");
    let (person, route, task) = walker(&actors, 0);
    assert_eq!(task, Task::Push);
    let mut reached = [f32::INFINITY, f32::NEG_INFINITY];
    for i in 0..1200 {
        let time = f64::from(i) / 30.0;
        let chair = tasks::chair(&route.at(time));
        let poses = person.poses(time);
        reached = [reached[0].min(chair.translation.x), reached[1].max(chair.translation.x)];
        for side in [0, 1] {
            let palm = skeleton::palm(&poses, &person.body.proportions, side);
            let local = chair.inverse() * Point3::from(palm);
            assert!((local - Point3::new(0.0, -0.25, 0.99)).norm() < 0.22, "a hand is at {local} of the chair");
        }
    }
    assert!(reached[1] - reached[0] > 3.0, "the chair moves within {reached:?} only");
}

#[test]
fn a_sitting_person_touches_seat_and_floor_and_penetrates_neither() {
    for seed in 1..6 {
        let (actors, config) = actors(&format!("sitting_static?seed={seed}&people=2&activity=crowd"));
        let scene = Scene::new(config.scene, config.seed);
        for (k, person) in actors.people.iter().enumerate() {
            let seat = scene.seats[config.people - 1 - k].position;
            let (mut sat, mut stood) = (0, 0);
            for i in 0..600 {
                let poses = person.poses(f64::from(i) / 30.0);
                let p = &person.body.proportions;
                let hips = poses[Bone::Pelvis.index()].translation.vector;
                let sole = skeleton::lowest_sole(&poses, p);
                assert!(sole.abs() < 0.035, "seed {seed}: the soles are {sole} m above the floor");
                // The undersides of pelvis and thighs are about 12 cm and 8 cm below their joints.
                let above = hips.z - seat.z;
                assert!(above > 0.08, "seed {seed}: the hips are {above} m above the seat");
                if (hips - seat).xy().norm() < 0.002 {
                    assert!(above < 0.12, "seed {seed}: floats {above} m above the seat");
                    sat += 1;
                }
                stood += usize::from(above > 0.3);
            }
            assert!(sat > 100, "seed {seed}: person {k} sits for {sat} of 600 frames");
            assert_eq!(stood > 100, k == 1, "seed {seed}: person {k} stands for {stood} of 600 frames");
        }
    }
}

#[test]
fn a_standing_foot_slides_by_less_than_a_quarter_of_the_walking_speed() {
    let (actors, _) = actors("walking_static?seed=3&people=2");
    let (person, route, _) = walker(&actors, 1);
    let (dt, mut slid, mut walked) = (1.0 / 120.0, 0.0, 0.0);
    // Heel and ball of both feet; the lowest of them carries the weight.
    let soles = |time: f64| {
        let poses = person.poses(time);
        let at = |side, y| poses[Bone::Foot(side).index()] * Point3::new(0.0, y, -person.body.proportions.ankle());
        [at(0, -0.05), at(0, 0.14), at(1, -0.05), at(1, 0.14)]
    };
    for i in 0..6000 {
        let time = f64::from(i) * dt;
        let speed = route.at(time).speed;
        if speed < 0.7 {
            continue;
        }
        let (now, then) = (soles(time), soles(time + dt));
        let carries = (0..4).min_by(|&a, &b| now[a].z.total_cmp(&now[b].z)).unwrap();
        slid += (then[carries] - now[carries]).xy().norm();
        walked += (speed * dt) as f32;
    }
    assert!(walked > 5.0, "walked {walked} m only");
    assert!(slid < 0.25 * walked, "the standing foot slides by {slid} m on {walked} m");
}

#[test]
fn a_displaced_box_is_out_of_view_before_and_after_and_ends_elsewhere() {
    let mut moved = 0;
    for seed in 1..6 {
        let (actors, config) = actors(&format!("walking_rpy?seed={seed}&people=0&moved=on&frames=600"));
        let scene = Scene::new(config.scene, config.seed);
        let path = CameraPath::new(&config, &scene);
        let [(_, Motion::Displaced(box_))] = actors.rigid_actors.as_slice() else { unreachable!("one rigid actor") };
        let places: Vec<_> = (0..600).map(|i| box_.at(f64::from(i) / 30.0)).collect();
        let jumps: Vec<usize> = (1..600).filter(|&i| distance(&places[i - 1], &places[i]) > 0.0).collect();
        assert!(jumps.len() <= 1, "displaced at {jumps:?}");
        for jump in jumps {
            moved += 1;
            assert!(distance(&places[jump - 1], &places[jump]) > 0.3);
            for i in [jump - 1, jump] {
                let view = path.pose(i as f64 / 30.0).inverse();
                assert!(!in_view(&config.camera, &view, &places[i].translation.vector, 0.2), "seen at frame {i}");
            }
        }
    }
    assert!(moved >= 3, "displaced in {moved} of 5 worlds");
    let (still, _) = self::actors("walking_static?seed=1&people=0&moved=on");
    let [(_, Motion::Displaced(box_))] = still.rigid_actors.as_slice() else { unreachable!("one rigid actor") };
    assert_eq!(box_.at(0.0), box_.at(9.0), "a camera that never turns away has every move in view");
}

#[test]
fn no_two_people_walk_through_each_other() {
    for spec in [
        "walking_xyz?seed=2&people=6&share=0.5",
        "walking_xyz?seed=3&people=4&robots=2&carry=on&chair=on",
        "corridor_loop?seed=1&people=6",
        "dark_rescue?seed=1&people=6",
    ] {
        let (mut actors, config) = actors(spec);
        let scene = Scene::new(config.scene, config.seed);
        let path = CameraPath::new(&config, &scene);
        for closeness in [0.3, 1.0, 2.0] {
            actors.set_closeness(&scene, &config, &path, closeness);
            let ways: Vec<&Route> = (0..config.people).map(|k| walker(&actors, k).1).collect();
            for i in 0..1200 {
                let time = f64::from(i) / 10.0;
                let places: Vec<[f64; 2]> = ways.iter().map(|route| route.at(time).position).collect();
                for (a, b) in (0..places.len()).flat_map(|a| (0..a).map(move |b| (a, b))) {
                    let gap = (places[a][0] - places[b][0]).hypot(places[a][1] - places[b][1]);
                    assert!(gap > 0.3, "{spec}, closeness {closeness}: {a} and {b} are {gap} m apart at {time} s");
                }
            }
        }
    }
}
