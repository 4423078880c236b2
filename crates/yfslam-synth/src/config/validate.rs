//! The ranges of all values of a world configuration.

use super::{Activity, CarriedObject, MAX_PEOPLE, WorldConfig, WorldError};

impl WorldConfig {
    /// Refuses values that are out of range.
    pub(crate) fn validate(&self) -> Result<(), WorldError> {
        let camera = &self.camera;
        let size = 16..=4096;
        let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
        check(self.people <= MAX_PEOPLE, "people", self.people, "between 0 and 6")?;
        let (robots, actors) = (self.actors.robots, &self.actors);
        check(
            self.people.saturating_add(robots) <= MAX_PEOPLE,
            "actors.robots",
            robots,
            "at most 6 together with the people",
        )?;
        let movers = usize::from(actors.pushed_chair) + usize::from(actors.carried_box);
        let free = if self.activity == Activity::Walking { self.people } else { 0 };
        check(
            movers <= free,
            "people",
            self.people,
            "at least as many as push a chair or carry a box, and they must walk (activity `walking`)",
        )?;
        let is_misplaced = !actors.carried_box && actors.carried_object != CarriedObject::Box;
        check(!is_misplaced, "actors.carried_object", "not a box", "omitted unless `carried_box` is on")?;
        check((0.0..=0.8).contains(&self.person_share), "person_share", self.person_share, "between 0 and 0.8")?;
        check((1..=1_000_000).contains(&self.frames), "frames", self.frames, "between 1 and 1000000")?;
        check(size.contains(&camera.width), "camera.width", camera.width, "between 16 and 4096 px")?;
        check(size.contains(&camera.height), "camera.height", camera.height, "between 16 and 4096 px")?;
        check(camera.fx.is_finite() && camera.fx > 1.0, "camera.fx", camera.fx, "greater than 1 px")?;
        check(camera.fy.is_finite() && camera.fy > 1.0, "camera.fy", camera.fy, "greater than 1 px")?;
        check(finite(&[camera.cx, camera.cy]), "camera.cx, camera.cy", camera.cx, "finite")?;
        check(finite(&camera.distortion), "camera.distortion", format!("{:?}", camera.distortion), "finite")?;
        check(finite(&camera.rational), "camera.rational", format!("{:?}", camera.rational), "finite")?;
        check((1e-3..=1e3).contains(&camera.fps), "camera.fps", camera.fps, "between 0.001 and 1000 Hz")?;
        let factor = self.depth_factor;
        check((1.0..=1e6).contains(&factor), "depth_factor", factor, "between 1 and 1000000 units per metre")?;
        check(camera.bf.is_finite() && camera.bf >= 0.0, "camera.bf", camera.bf, "at least 0 px·m")?;
        check((0.0..=2.0).contains(&self.stereo_m), "stereo_m", self.stereo_m, "between 0 and 2 m")?;
        if self.stereo_m > 0.0 {
            let distortion = camera.distortion;
            check(
                distortion == [0.0; 5] && camera.rational == [0.0; 3],
                "camera.distortion",
                format!("{distortion:?}"),
                "zero for a stereo camera, whose images are rectified (such as --camera tum3)",
            )?;
            let same = (camera.bf / (self.stereo_m * camera.fx) - 1.0).abs() < 1e-6;
            check(same, "camera.bf", camera.bf, "stereo_m times camera.fx")?;
        }
        check((0.0..=20.0).contains(&self.hand_shake), "hand_shake", self.hand_shake, "between 0 and 20")?;
        let light = &self.light;
        check(light.shadow_rays <= 1024, "light.shadow_rays", light.shadow_rays, "at most 1024")?;
        check((0.0..=100.0).contains(&light.exposure), "light.exposure", light.exposure, "between 0 and 100")?;
        check((0.0..=1.0).contains(&light.flicker), "light.flicker", light.flicker, "between 0 and 1")?;
        let s = &self.sensor;
        for (name, value) in [
            ("sensor.color_noise", s.color_noise),
            ("sensor.depth_noise_m", s.depth_noise_m),
            ("sensor.depth_noise_growth", s.depth_noise_growth),
            ("sensor.depth_noise_angle", s.depth_noise_angle),
            ("sensor.disparity_step_px", s.disparity_step_px),
            ("sensor.min_return", s.min_return),
        ] {
            check((0.0..=100.0).contains(&value), name, value, "between 0 and 100")?;
        }
        check((0.0..=90.0).contains(&s.max_angle_deg), "sensor.max_angle_deg", s.max_angle_deg, "between 0 and 90")?;
        let (offset, exposure) = (s.depth_offset_s, s.exposure_s);
        check((-1.0..=1.0).contains(&offset), "sensor.depth_offset_s", offset, "between -1 and 1 s")?;
        for (name, ms) in [("sensor.readout_ms", s.readout_ms), ("sensor.depth_readout_ms", s.depth_readout())] {
            check((-100.0..=100.0).contains(&ms), name, ms, "between -100 and 100 ms")?;
        }
        check((0.0..=1.0).contains(&exposure), "sensor.exposure_s", exposure, "between 0 and 1 s")?;
        check((0.0..=1.0).contains(&s.auto_exposure), "sensor.auto_exposure", s.auto_exposure, "between 0 and 1")?;
        check(s.min_depth_m >= 0.0, "sensor.min_depth_m", s.min_depth_m, "at least 0 m")?;
        check(s.max_depth_m > s.min_depth_m, "sensor.max_depth_m", s.max_depth_m, "greater than sensor.min_depth_m")
    }
}

fn check(good: bool, name: &'static str, value: impl ToString, range: &'static str) -> Result<(), WorldError> {
    if good { Ok(()) } else { Err(WorldError::OutOfRange { name, value: value.to_string(), range }) }
}
