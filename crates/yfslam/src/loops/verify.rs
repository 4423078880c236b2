//! Verification of a candidate: the pose by P3P in RANSAC (Fischler and Bolles, 1981), then a guided search, as in the
//! relocalisation of ORB-SLAM (IEEE T-RO 2015, section V-C).
//!
//! In: a frame and a candidate. Out: the frame's pose and matches, or none.

use nalgebra::{Point3, Vector3};
use rand_pcg::Pcg64Mcg;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::place_recognition::Candidate;
use crate::config::PlaceConfig;
use crate::context::{Context, SensorModel};
use crate::geometry::{Pose, p3p};
use crate::map::{KeyFrameId, Landmark, LandmarkId, Map};
use crate::optimize::pose_only::{self, PoseObservation};
use crate::optimize::residual::Measurement;
use crate::tracking::search::{Projector, search_local_map};
use crate::tracking::{Match, TrackedFrame};

/// The support of a pose by matches.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Support {
    /// Number of inliers.
    pub inliers: usize,
    /// Match ratio: the number of inliers with a similar descriptor, divided by the number that tracking would find from this pose.
    /// That is the sum of the found ratios of the landmarks in view that are not behind moving objects. In corridors with repeated
    /// doors and lamps many landmarks are inliers of a wrong pose, but more are missing.
    pub match_ratio: f64,
}

impl Support {
    /// Returns whether both values reach those of `needed`.
    pub(super) fn reaches(&self, needed: &Self) -> bool {
        self.inliers >= needed.inliers && self.match_ratio >= needed.match_ratio
    }
}

/// Localises `frame` among the landmarks of `candidate`; sets its pose and matches. `None` if the support is less than `needed`, or
/// if the matches do not fix the position well enough.
pub(super) fn localise(
    context: &Context,
    map: &Map,
    candidate: &Candidate,
    frame: &mut TrackedFrame,
    needed: &Support,
) -> Option<Support> {
    let Context { sensor, config } = context;
    let c = &config.place_recognition;
    let pairs: Vec<Pair> = candidate.matches.iter().filter_map(|m| Pair::new(sensor, map, frame, *m)).collect();
    // Depth, where measured, selects among the solutions of P3P.
    let pose = ransac(
        c,
        pairs.len(),
        c.min_ransac_inliers,
        |sample| p3p(&sample.map(|i| pairs[i].point_world), &sample.map(|i| pairs[i].ray)),
        |pose, i| pairs[i].fits(sensor, pose),
    )?;
    frame.clear_matches();
    frame.t_cam_world = pose;
    for pair in pairs.iter().filter(|pair| pair.fits(sensor, &pose)) {
        frame.matches[pair.feature] =
            Some(Match { landmark: Some(pair.landmark), point_world: pair.point_world, trust: 1.0 });
    }
    let mut inliers = frame.refine_pose(context);
    let (mut visible, mut expected) = (Vec::new(), 0.0);
    // The second search starts from a better pose.
    for _ in 0..2 {
        if inliers < c.min_refined_inliers {
            return None;
        }
        let landmarks = unmatched_landmarks(map, &candidate.group, frame);
        search_local_map(context, map, &landmarks, frame, &mut visible);
        visible.extend(frame.matches.iter().flatten().filter_map(|matched| matched.landmark));
        visible.sort_unstable();
        visible.dedup();
        let projector = Projector::new(sensor, &frame.t_cam_world);
        let in_view = visible.iter().filter_map(|id| map.landmark(*id));
        expected = in_view.filter(|l| !is_occluded(c, &projector, frame, l)).map(Landmark::found_ratio).sum();
        inliers = frame.refine_pose(context);
    }
    let projector = Projector::new(sensor, &frame.t_cam_world);
    let similar = frame.matches.iter().zip(&frame.features.descriptors).filter(|(matched, descriptor)| {
        let landmark = matched.and_then(|s| map.landmark(s.landmark?));
        landmark.is_some_and(|l| {
            l.descriptor.distance(descriptor) <= c.max_distance && !is_occluded(c, &projector, frame, l)
        })
    });
    let support = Support { inliers, match_ratio: similar.count() as f64 / expected.max(1.0) };
    let is_fixed = position_sigma_m(sensor, frame) <= c.max_position_sigma_m;
    (is_fixed && support.reaches(needed)).then_some(support)
}

/// Returns the standard deviation of the camera position given the matches, m.
fn position_sigma_m(sensor: &SensorModel, frame: &TrackedFrame) -> f64 {
    let matched = frame
        .matches
        .iter()
        .zip(&frame.features.features)
        .filter_map(|(matched, feature)| Some(((*matched)?, feature)));
    let observations: Vec<PoseObservation> = matched
        .map(|(matched, feature)| PoseObservation {
            point_world: matched.point_world,
            measurement: sensor.measurement(feature),
            trust: f64::from(feature.trust),
            inlier: true,
        })
        .collect();
    pose_only::position_sigma_m(&sensor.pinhole, &frame.t_cam_world, &observations)
}

/// Returns whether something that moves is at the projection of a landmark and may occlude it.
fn is_occluded(config: &PlaceConfig, projector: &Projector<'_>, frame: &TrackedFrame, landmark: &Landmark) -> bool {
    let Some(projection) = projector.project(&landmark.position) else { return false };
    let mut occluded = false;
    frame.features.for_each_near(projection.u, projection.v, config.occlusion_radius_px, 0..=u8::MAX, |j| {
        occluded |= frame.features.features[j].trust <= 0.0;
    });
    occluded
}

/// Returns the landmarks that the keyframes observe and the frame does not match.
fn unmatched_landmarks(map: &Map, keyframes: &[KeyFrameId], frame: &TrackedFrame) -> Vec<LandmarkId> {
    let mut matched: Vec<LandmarkId> = frame.matches.iter().flatten().filter_map(|s| s.landmark).collect();
    matched.sort_unstable();
    let mut landmarks: Vec<LandmarkId> =
        keyframes.iter().filter_map(|id| map.keyframe(*id)).flat_map(|k| k.observed().map(|(_, l)| l)).collect();
    landmarks.sort_unstable();
    landmarks.dedup();
    landmarks.retain(|id| matched.binary_search(id).is_err());
    landmarks
}

/// A feature and the landmark it may show.
struct Pair {
    feature: usize,
    landmark: LandmarkId,
    point_world: Point3<f64>,
    measurement: Measurement,
    /// Viewing ray of the feature, unit length.
    ray: Vector3<f64>,
}

impl Pair {
    fn new(sensor: &SensorModel, map: &Map, frame: &TrackedFrame, (feature, id): (u32, LandmarkId)) -> Option<Self> {
        let (f, landmark) = (frame.features.features.get(feature as usize)?, map.landmark(id)?);
        Some(Self {
            feature: feature as usize,
            landmark: id,
            point_world: landmark.position,
            measurement: sensor.measurement(f),
            ray: sensor.pinhole.unproject(f64::from(f.u), f64::from(f.v), 1.0).coords.normalize(),
        })
    }

    fn fits(&self, sensor: &SensorModel, t_cam_world: &Pose) -> bool {
        let p = (t_cam_world * self.point_world).coords;
        let m = &self.measurement;
        p.z > 1e-3 && m.chi2(&m.residual(&sensor.pinhole, &p)) <= m.chi2_limit()
    }
}

/// Returns the model with most inliers among `count` pairs, if they are at least `min_inliers`; each model is made from three
/// pairs. It ends when a better model has become unlikely.
pub(super) fn ransac<M: Copy, I: IntoIterator<Item = M>>(
    config: &PlaceConfig,
    count: usize,
    min_inliers: usize,
    models: impl Fn([usize; 3]) -> I,
    fits: impl Fn(&M, usize) -> bool,
) -> Option<M> {
    if count < min_inliers.max(3) {
        return None;
    }
    // The generator is seeded anew for each call: a result depends on its input alone.
    let mut rng = Pcg64Mcg::seed_from_u64(config.seed);
    let mut draw = || ((u64::from(rng.next_u32()) * count as u64) >> 32) as usize;
    let mut best: Option<(usize, M)> = None;
    let mut draws = config.ransac_iterations as f64;
    let mut drawn = 0;
    while f64::from(drawn) < draws {
        drawn += 1;
        let sample = [draw(), draw(), draw()];
        let [a, b, c] = sample;
        if a == b || a == c || b == c {
            continue;
        }
        for model in models(sample) {
            // A model must fit its own three pairs, which hold more data than it was made from.
            if !sample.iter().all(|i| fits(&model, *i)) {
                continue;
            }
            let inliers = (0..count).filter(|i| fits(&model, *i)).count();
            if best.as_ref().is_none_or(|(most, _)| inliers > *most) {
                best = Some((inliers, model));
                let share = inliers as f64 / count as f64;
                let needed = libm::log(1.0 - config.ransac_confidence) / libm::log((1.0 - share.powi(3)).max(1e-9));
                draws = draws.min(needed.ceil().max(1.0));
            }
        }
    }
    best.filter(|(inliers, _)| *inliers >= min_inliers).map(|(_, model)| model)
}
