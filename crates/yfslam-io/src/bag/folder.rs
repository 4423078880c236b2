//! A folder that rosbag2 made: `metadata.yaml`, and the files that it lists.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::text::read_text;

const METADATA: &str = "metadata.yaml";

/// Returns whether a folder is a bag.
pub fn is_bag_folder(path: &Path) -> bool {
    path.is_dir()
        && std::fs::metadata(path.join(METADATA)).is_ok_and(|file| file.is_file() && file.len() < 16 << 20)
        && read_text(&path.join(METADATA)).is_ok_and(|text| text.contains("rosbag2_bagfile_information"))
}

/// Returns the files of the bag in their order.
pub fn files(folder: &Path) -> Result<Vec<PathBuf>> {
    let path = folder.join(METADATA);
    let text = read_text(&path)?;
    let names = listed(&text);
    if names.is_empty() {
        let cure = "write it again with `ros2 bag reindex`, or name the .mcap or .db3 file itself";
        return Err(Error::content(&path, "lists no file under relative_file_paths", cure));
    }
    let packed = names.iter().find(|name| name.ends_with(".zstd"));
    if let Some(name) = packed {
        let problem = format!("lists {name}, which is packed as a whole");
        let cure = format!("unpack it with `zstd -d {name}`, and name the unpacked file instead of the folder");
        return Err(Error::content(&path, problem, cure));
    }
    // Early versions wrote the name of the folder, too, and a folder may have been renamed.
    let in_folder = |name: &String| {
        let path = folder.join(name);
        let by_name = Path::new(name).file_name().map(|name| folder.join(name));
        if path.is_file() { path } else { by_name.unwrap_or(path) }
    };
    Ok(names.iter().map(in_folder).collect())
}

/// Returns the items of the list `relative_file_paths`.
fn listed(text: &str) -> Vec<String> {
    let mut lines = text.lines().skip_while(|line| !line.trim_start().starts_with("relative_file_paths:"));
    let Some(first) = lines.next() else { return Vec::new() };
    let clean = |name: &str| name.trim().trim_matches(['"', '\'']).to_owned();
    let inline = first.split_once(':').map_or("", |(_, rest)| rest.trim());
    if let Some(items) = inline.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
        return items.split(',').map(clean).filter(|name| !name.is_empty()).collect();
    }
    lines.map_while(|line| line.trim_start().strip_prefix("- ")).map(clean).collect()
}
