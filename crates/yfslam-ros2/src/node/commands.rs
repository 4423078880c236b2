//! Requests, and what happens at the end.

use std::path::Path;

use anyhow::{Context, Result, bail};
use yfslam::{MapUse, SavedMap};
use yfslam_io::{StampedPose, write_atomically, write_trajectory};

use super::Node;
use crate::messages::PoseWithCovarianceStamped;
use crate::slam_factory::load_map;
use crate::transport::{Command, Request, Transport};

/// A pose that is farther from the origin is a mistake, m.
const FARTHEST_M: f64 = 1e6;

impl<T: Transport> Node<T> {
    pub(super) fn answer(&mut self, request: Request) {
        let answer = match request.command {
            Command::SaveMap => self.save_map(),
            Command::Reset => self.reset(),
            Command::Pause | Command::Resume => self.pause(request.command == Command::Pause),
            Command::Localise => self.use_map(MapUse::Localise),
            Command::Extend => self.use_map(MapUse::Extend),
            Command::LoadMap => self.load_file(),
        };
        let answer = answer.map_err(|error| format!("{error:#}"));
        match &answer {
            Ok(message) => tracing::info!("{}: {message}", request.command.name()),
            Err(message) => tracing::warn!("{}: {message}", request.command.name()),
        }
        self.transport.reply(request, answer);
    }

    fn save_map(&mut self) -> Result<String> {
        let path = self.parameters.text("map_file").to_owned();
        let session = self.session.as_mut().context("there is no map yet: no camera_info has come")?;
        session.finish_mapping();
        let (keyframes, landmarks) = (session.slam().map().keyframe_count(), session.slam().map().landmarks().count());
        if keyframes == 0 {
            bail!("there is no map yet; an earlier {path} stays as it is");
        }
        let bytes = session.slam_mut().save_map()?;
        write_atomically(Path::new(&path), |file| file.write_all(&bytes))?;
        Ok(format!("{path}: {keyframes} keyframes, {landmarks} landmarks, {} bytes", bytes.len()))
    }

    fn reset(&mut self) -> Result<String> {
        let (camera, _) = self.camera.as_ref().context("there is nothing to reset: no camera_info has come")?;
        let slam = self.factory.build(camera, None)?;
        let session = self.session.as_mut().context("there is nothing to reset: the node has not begun")?;
        session.replace(slam);
        self.is_localising = false;
        self.is_map_loaded = false;
        self.begin_map_anew();
        Ok("a new map begins with the next image".into())
    }

    fn pause(&mut self, is_paused: bool) -> Result<String> {
        let session = self.session.as_mut().context("the node has not begun: no camera_info has come")?;
        session.pause(is_paused);
        self.split.lose();
        Ok(if is_paused { "images are ignored until resume" } else { "images are used again" }.into())
    }

    fn use_map(&mut self, map_use: MapUse) -> Result<String> {
        let (camera, _) = self.camera.as_ref().context("there is no map yet: no camera_info has come")?;
        let session = self.session.as_mut().context("there is no map yet: the node has not begun")?;
        session.finish_mapping();
        if session.slam().map().keyframe_count() == 0 {
            bail!("there is no map yet");
        }
        let saved = SavedMap::from_bytes(&session.slam_mut().save_map()?)?;
        let slam = self.factory.build(camera, Some((saved, map_use)))?;
        session.replace(slam);
        self.is_localising = map_use == MapUse::Localise;
        self.split.lose();
        self.resets = 0;
        self.grid_keyframes = usize::MAX;
        Ok(if self.is_localising { "the map stays as it is from now on" } else { "the map is extended from now on" }
            .into())
    }

    /// Takes the map of the file in place of the present one, which is lost unless it was saved.
    fn load_file(&mut self) -> Result<String> {
        let path = self.parameters.text("map_file").to_owned();
        let (camera, _) = self.camera.as_ref().context("the camera is not known yet: no camera_info has come")?;
        let session = self.session.as_mut().context("the node has not begun")?;
        let map_use = if self.is_localising { MapUse::Localise } else { MapUse::Extend };
        let slam = self.factory.build(camera, Some((load_map(&path)?, map_use)))?;
        session.replace(slam);
        self.is_map_loaded = true;
        self.begin_map_anew();
        self.grid_keyframes = usize::MAX;
        Ok(format!("{path} is the map from now on; the camera is lost until it is recognised in it"))
    }

    fn begin_map_anew(&mut self) {
        self.split.lose();
        self.resets = 0;
        self.grid_keyframes = 0;
        self.grid_note = None;
        self.last_pose = None;
        self.t_map_moved = nalgebra::Isometry3::identity();
    }

    /// Moves the map frame so that the base is where the user says. A saved map has its frame already.
    pub(super) fn set_initial_pose(&mut self, message: &PoseWithCovarianceStamped) {
        let map_frame = self.parameters.text("map_frame");
        let frame = message.header.frame_id.trim_start_matches('/');
        if !frame.is_empty() && frame != map_frame {
            return tracing::warn!("initialpose is in frame {frame}; give it in {map_frame}");
        }
        if self.is_map_loaded {
            return tracing::warn!(
                "initialpose is left out: the loaded map has its frame, and the camera is recognised in it without help"
            );
        }
        let wanted = message.pose.pose.to_isometry().filter(|pose| pose.translation.vector.norm() <= FARTHEST_M);
        let (Some(wanted), Some(pose)) = (wanted, self.last_pose) else {
            return tracing::warn!("initialpose is left out: the pose is not known, or the message is no pose");
        };
        let t_new_old = wanted * pose.inverse();
        self.t_map_moved = t_new_old * self.t_map_moved;
        self.split.move_map(&t_new_old);
        self.last_pose = Some(wanted);
        self.grid_keyframes = usize::MAX;
        tracing::info!("the map frame was moved, so that the base is at {}", wanted.translation.vector.transpose());
    }

    /// Writes what is to be written at the end.
    ///
    /// # Errors
    /// A file cannot be written.
    pub fn finish(mut self) -> Result<()> {
        let mut first = Ok(());
        if self.parameters.flag("save_on_exit") && self.session.is_some() {
            match self.save_map() {
                Ok(message) => tracing::info!("saved {message}"),
                Err(error) => first = Err(error),
            }
        }
        let path = self.parameters.text("trajectory_file").to_owned();
        if let (Some(session), Some(mount)) = (&mut self.session, &self.mount)
            && !path.is_empty()
        {
            session.finish_mapping();
            let poses = session.slam().trajectory().into_iter().map(|(stamp_ns, t_world_cam)| {
                let t_map_base = self.t_map_moved * mount.t_map_world * t_world_cam * mount.t_base_cam.inverse();
                StampedPose::new(stamp_ns, t_map_base)
            });
            let poses: Vec<_> = poses.collect();
            let written = write_trajectory(Path::new(&path), &poses);
            tracing::info!("{path}: {} poses", poses.len());
            first = first.and(written.map_err(Into::into));
        }
        first
    }
}
