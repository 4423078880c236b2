//! In: a report. Out: its figures as files of their own, each with its legend inside.

use super::bars::bars;
use super::ink::Ink;
use super::over_time::over_time;
use super::scene::{Captioned, Scene};
use super::views::{multiples, views};
use crate::content::Report;

/// A figure in a file of its own.
#[derive(Clone, Debug)]
pub struct FigureFile {
    /// Name without an ending, such as `trajectory-from-above`.
    pub name: String,
    /// Title, for a caption.
    pub title: String,
    /// The figure as SVG.
    pub svg: String,
    /// The figure as PDF.
    pub pdf: Vec<u8>,
}

impl Report<'_> {
    /// Returns all figures of trajectories and errors.
    pub fn figures(&self) -> Vec<FigureFile> {
        let scene = Scene::new(self);
        let methods = scene.methods.iter().map(|method| (method.name.to_owned(), method.ink));
        let methods: Vec<(String, Ink)> = methods.collect();
        let truth = scene.truth.as_ref().map(|_| ("ground truth".to_owned(), Ink::Truth));
        let with_truth: Vec<(String, Ink)> = truth.into_iter().chain(methods.iter().cloned()).collect();
        let mut files: Vec<FigureFile> =
            views(&scene).into_iter().map(|one| file("trajectory-", one, &with_truth)).collect();
        let multiples = multiples(&scene);
        files.extend(multiples.figures.into_iter().map(|one| file("trajectory-error-of-", one, &multiples.legend)));
        files.extend(over_time(&scene).into_iter().map(|one| file("", one, &methods)));
        files.extend(bars(self, &scene).map(|one| file("", one, &methods)));
        files
    }
}

fn file(prefix: &str, mut captioned: Captioned, legend: &[(String, Ink)]) -> FigureFile {
    captioned.figure.legend = legend.to_vec();
    let words: Vec<String> = captioned
        .title
        .split(|c: char| !c.is_ascii_alphanumeric())
        .filter(|w| !w.is_empty())
        .map(str::to_lowercase)
        .collect();
    let (svg, pdf) = (captioned.figure.svg_file(), captioned.figure.pdf());
    FigureFile { name: format!("{prefix}{}", words.join("-")), title: captioned.title, svg, pdf }
}
