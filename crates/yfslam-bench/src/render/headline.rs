//! The first page: the figures that matter most, beside those of other systems.

use std::collections::BTreeMap;

use anyhow::Result;

use super::{GENERATED, Spread, Table, measured_on, one_state, select};
use crate::record::Record;
use crate::topics::TOPICS;
use crate::topics::recordings::RECORDINGS;

/// Our methods on this page, with their names in the tables.
const METHODS: [(&str, &str); 2] = [("full", "**yfslam**, `full` (default)"), ("none", "yfslam, `none` (no filter)")];
const NOT_MEASURED: &str = "not measured on this state";

type Topics = BTreeMap<&'static str, Vec<Record>>;

/// The table of the readme.
///
/// # Errors
/// A table would mix records of different states.
pub fn table(topics: &Topics, peers: &[Record]) -> Result<String> {
    one_state(ours(topics))?;
    let [ate, process, memory] = [
        figures(topics, "recordings", &[("direction", "forward"), ("start", "0")], "ate_m", 4),
        figures(topics, "cost", &[], "process_ms_per_frame", 1),
        figures(topics, "cost", &[], "peak_mb", 0),
    ];
    let headers = ["ATE, m", "whole process, ms a frame", "memory, MB"];
    let columns = RECORDINGS.iter().flat_map(|name| headers.iter().map(move |header| format!("{name}: {header}")));
    let mut table = Table::new(["system".to_owned()].into_iter().chain(columns));
    for (method, title) in METHODS {
        let cells = RECORDINGS.iter().flat_map(|name| {
            let key = ((*name).to_owned(), method.to_owned());
            [&ate, &process, &memory].map(|figures| figures.get(&key).map_or(NOT_MEASURED, String::as_str).to_owned())
        });
        table.row([title.to_owned()].into_iter().chain(cells));
    }
    let peers: Vec<&Record> = peers.iter().collect();
    for system in super::values(&peers, "system") {
        let cells = RECORDINGS.iter().flat_map(|name| {
            let rows = select(&peers, &[("system", system), ("sequence", name)]);
            [("ate_m", 4), ("process_ms_per_frame", 1), ("peak_mb", 0)]
                .map(|(key, decimals)| Spread::text(rows.iter().find_map(|record| spread(record, key)), decimals))
        });
        let has_figures = RECORDINGS.iter().any(|name| {
            let rows = select(&peers, &[("system", system), ("sequence", name)]);
            rows.iter().any(|record| record.figures.contains_key("ate_m"))
        });
        if has_figures {
            table.row([system.to_owned()].into_iter().chain(cells));
        }
    }
    Ok(table.to_string())
}

/// Our records of which this page has figures.
fn ours(topics: &Topics) -> Vec<&Record> {
    let topics = ["recordings", "cost"].into_iter().filter_map(|name| topics.get(name));
    topics.flatten().filter(|record| is_embedded(record)).collect()
}

/// Whether a record was measured with the network in the program.
fn is_embedded(record: &Record) -> bool {
    record.state.network.starts_with("embedded")
}

/// Our figures by sequence and method.
fn figures(
    topics: &Topics,
    topic: &str,
    case: &[(&str, &str)],
    key: &str,
    decimals: usize,
) -> BTreeMap<(String, String), String> {
    let of_topic = topics.get(topic).into_iter().flatten().filter(|record| is_embedded(record));
    let records = select(&of_topic.collect::<Vec<_>>(), case);
    let mut found = BTreeMap::new();
    for name in RECORDINGS {
        for (method, _) in METHODS {
            let rows = select(&records, &[("sequence", name), ("method", method)]);
            let spread = Spread::of(rows.iter().map(|record| record.figure(key)));
            if spread.is_some() {
                found.insert((name.to_owned(), method.to_owned()), Spread::text(spread, decimals));
            }
        }
    }
    found
}

/// A figure of a peer: a list of its runs.
fn spread(record: &Record, key: &str) -> Option<Spread> {
    let value = record.figures.get(key)?;
    match value.as_array() {
        Some(list) => Spread::of(list.iter().map(serde_json::Value::as_f64)),
        None => Spread::of([value.as_f64()]),
    }
}

/// The page.
///
/// # Errors
/// As [`table`].
pub fn page(topics: &Topics, peers: &[Record]) -> Result<String> {
    let ours = ours(topics);
    let mut text = format!(
        "{GENERATED}\n# Results\n\n\
         Every table on these pages is generated from the records in [data/](data/), each of which names the commit, the network and the machine \
         on which it was measured. `yfslam-bench measure all` measures, `yfslam-bench render` writes the pages, and CI compares them. What \
         was learned on earlier states is in the [notes](../notes/README.md).\n\n"
    );
    text += &if ours.is_empty() {
        "Our figures: not measured on this state.\n\n".to_owned()
    } else {
        measured_on(&ours) + "\n\n"
    };
    text += &table(topics, peers)?;
    text += "\nThe sequences are the first 300 pairs of TUM `freiburg1_xyz`, a static desk, and the first 600 of Bonn `rgbd_bonn_crowd`, in which \
             up to three people walk past the camera. ATE is the RMSE of the positions after alignment by SE(3), from the first frame, forward. \
             The whole process is its processor time of all threads, with reading the images, as the operating system counts it. Medians, with the least \
             and the greatest of several runs in brackets. The other systems were measured on a \
             machine of the same kind, not in the same run ([how](peers.md)).\n";
    text += "\n## Pages\n\n";
    let mut list = Table::new(["page", "measured on", "minutes to measure"]);
    for topic in TOPICS {
        let records: Vec<&Record> = topics.get(topic.name).into_iter().flatten().collect();
        let state = if records.is_empty() { NOT_MEASURED.to_owned() } else { measured_on(&records) };
        let link = format!("[{}]({}.md)", topic.title, topic.name);
        list.row([
            link,
            state.trim_start_matches("Measured on ").trim_end_matches('.').to_owned(),
            topic.minutes.to_string(),
        ]);
    }
    Ok(text + &list.to_string())
}

/// The page of the other systems: every figure with how, where and when it was measured.
pub fn peers_page(peers: &[Record]) -> String {
    let mut how = Table::new(["system", "sequence", "figures", "measured", "how"]);
    for record in peers {
        let name = |key: &str| match key {
            "ate_m" | "ate_runs_m" => "ATE, m".to_owned(),
            "process_ms_per_frame" => "whole process, ms a frame".to_owned(),
            "tracking_thread_ms" => "tracking thread, ms a frame".to_owned(),
            "peak_mb" => "memory, MB".to_owned(),
            other => other.to_owned(),
        };
        let value = |value: &serde_json::Value| value.to_string().replace(['[', ']'], "").replace(',', " / ");
        let figures: Vec<_> =
            record.figures.iter().map(|(key, figure)| format!("{}: {}", name(key), value(figure))).collect();
        how.row([
            record.case("system").to_owned(),
            record.case("sequence").to_owned(),
            figures.join("; "),
            format!("{}, {}", record.date, record.state.machine.cpu),
            record.command.clone(),
        ]);
    }
    format!(
        "{GENERATED}\n# Other systems\n\nFigures of other systems that were measured for this project, with our builds of them. ATE after alignment by SE(3).\n\n{how}"
    )
}
