//! Times of rendering: frames of every scene at 640 × 480 once their surfaces are computed, and the time until the first frame.
#![allow(clippy::expect_used, reason = "a benchmark fails as tests do")]

use criterion::{Criterion, criterion_group, criterion_main};
use yfslam_synth::{SceneKind, World, WorldConfig, parse};

fn config(scene: &str) -> WorldConfig {
    parse(&format!("synth:walking_xyz?scene={scene}&people=2")).expect("the spec is valid")
}

fn benches(criterion: &mut Criterion) {
    for (scene, _) in SceneKind::ALL {
        let config = config(scene);
        let world = World::new(&config).expect("the world is valid");
        let mut frames = (0..world.len()).step_by(15).cycle();
        (0..world.len()).step_by(15).for_each(|index| drop(world.frame(index)));
        criterion.bench_function(&format!("render/frame/{scene}"), |bencher| {
            bencher.iter(|| frames.next().map(|index| world.frame(index)));
        });
        let mut group = criterion.benchmark_group("render/start");
        group.sample_size(10);
        group.bench_function(scene, |bencher| bencher.iter(|| World::new(&config).map(|world| world.frame(0))));
    }
}

criterion_group!(render_benches, benches);
criterion_main!(render_benches);
