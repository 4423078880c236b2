//! In: errors of several systems over runs. Out: a box for each system: quartiles, median, whiskers to the extremes, and a dot for each run.

use super::axis::Axis;
use super::files::FigureFile;
use super::ink::Ink;
use super::path::Point;
use super::plot::{Figure, Mark};
use super::scene::{LOG_FROM_RATIO, WIDTH, bounds};

const HEIGHT: f64 = 330.0;
/// Width of a box and of the ends of its whiskers, as shares of the distance between two boxes.
const BOX: f64 = 0.5;
const END: f64 = 0.2;

/// Draws the absolute trajectory errors of systems, m; `None` if no system has three runs.
pub fn errors_over_runs(systems: &[(String, Vec<f64>)]) -> Option<FigureFile> {
    let systems: Vec<(&str, Vec<f64>)> = systems
        .iter()
        .map(|(name, values)| (name.as_str(), sorted(values)))
        .filter(|(_, values)| !values.is_empty())
        .collect();
    if systems.iter().all(|(_, values)| values.len() < 3) {
        return None;
    }
    let [smallest, largest] = bounds(systems.iter().flat_map(|(_, values)| values.iter().copied()))?;
    let y = if smallest > 0.0 && largest / smallest > LOG_FROM_RATIO {
        Axis::log_lengths("ATE RMSE, logarithmic", [smallest * 0.7, largest * 1.4])
    } else {
        Axis::linear("ATE RMSE (m)", [0.0, largest.max(1e-6) * 1.1], 4, 1.0)
    };
    let marks = systems.iter().enumerate().flat_map(|(at, (name, values))| {
        let ink = Ink::method(name, at);
        box_of(at as f64, values, ink)
    });
    let title = "ATE RMSE over the runs".to_owned();
    let names: Vec<&str> = systems.iter().map(|(name, _)| *name).collect();
    let figure = Figure {
        description: format!("{title}: {}", names.join(", ")),
        size: [WIDTH, HEIGHT],
        x: Axis::groups(&names),
        y,
        marks: marks.collect(),
        legend: Vec::new(),
    };
    Some(FigureFile { name: "ate-over-runs".into(), title, svg: figure.svg_file(), pdf: figure.pdf() })
}

fn sorted(values: &[f64]) -> Vec<f64> {
    let mut values: Vec<f64> = values.iter().copied().filter(|value| value.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Returns the value below which a share of the sorted values lies, interpolated between neighbours.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = share * sorted.len().saturating_sub(1) as f64;
    let at = |index: usize| sorted.get(index).or(sorted.last()).copied().unwrap_or(0.0);
    let below = at(place.floor() as usize);
    below + (at(place.ceil() as usize) - below) * place.fract()
}

fn box_of(x: f64, values: &[f64], ink: Ink) -> Vec<Mark> {
    let [low, first, median, third, high] = [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| quantile(values, share));
    let (left, right) = (x - BOX / 2.0, x + BOX / 2.0);
    let line = |points: Vec<Point>, width: f64| Mark::Line { points, ink, width, opacity: 1.0 };
    let level = |y: f64, half: f64, width: f64| line(vec![[x - half, y], [x + half, y]], width);
    let mut marks = vec![
        line(vec![[left, first], [right, first], [right, third], [left, third], [left, first]], 1.6),
        level(median, BOX / 2.0, 3.0),
        line(vec![[x, low], [x, first]], 1.2),
        line(vec![[x, third], [x, high]], 1.2),
        level(low, END / 2.0, 1.2),
        level(high, END / 2.0, 1.2),
    ];
    marks.extend(values.iter().map(|value| Mark::Dot { at: [x, *value], ink, radius: 2.0 }));
    marks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quartiles_are_interpolated_and_few_runs_have_no_box() {
        let values = sorted(&[4.0, 1.0, f64::NAN, 2.0, 3.0]);
        assert_eq!([0.0, 0.25, 0.5, 1.0].map(|share| quantile(&values, share)), [1.0, 1.75, 2.5, 4.0]);
        let systems = |runs: usize| vec![("a".to_owned(), vec![0.1; runs]), ("b".to_owned(), vec![0.2; runs])];
        assert!(errors_over_runs(&systems(2)).is_none() && errors_over_runs(&[]).is_none());
        let figure = errors_over_runs(&systems(3)).unwrap();
        assert!(figure.svg.starts_with("<svg ") && figure.svg.contains("ATE RMSE (m)"));
        assert!(figure.pdf.starts_with(b"%PDF-"));
    }
}
