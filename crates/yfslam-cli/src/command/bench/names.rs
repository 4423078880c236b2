//! Names of recordings in tables and files: the name of the folder, with as many of its parents as distinguish it from the others.

use std::collections::BTreeMap;
use std::path::{Component, Path};

/// Returns a name for each folder, in their order.
pub fn distinct_names(folders: &[&Path]) -> Vec<String> {
    let parts: Vec<Vec<String>> = folders.iter().map(|folder| parts(folder)).collect();
    let mut lengths = vec![1; folders.len()];
    loop {
        let name = |(parts, length): (&Vec<String>, &usize)| parts[parts.len().saturating_sub(*length)..].join("/");
        let names: Vec<String> = parts.iter().zip(&lengths).map(name).collect();
        let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
        names.iter().for_each(|name| *counts.entry(name).or_default() += 1);
        let mut is_distinct = true;
        for ((name, parts), length) in names.iter().zip(&parts).zip(&mut lengths) {
            if counts[name.as_str()] > 1 && *length < parts.len() {
                *length += 1;
                is_distinct = false;
            }
        }
        if is_distinct {
            return names;
        }
    }
}

/// Returns the names on the way to a folder, its own name last.
fn parts(folder: &Path) -> Vec<String> {
    // A link to a folder has the name of the link; `.` and `..` have that of the folder.
    let path = if folder.file_name().is_some() { std::path::absolute(folder) } else { folder.canonicalize() };
    let path = path.unwrap_or_else(|_| folder.into());
    let names = path.components().filter(|part| matches!(part, Component::Normal(_)));
    names.map(|part| part.as_os_str().to_string_lossy().into_owned()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_of_the_same_name_have_different_names() {
        let names = |folders: &[&str]| distinct_names(&folders.iter().map(Path::new).collect::<Vec<_>>());
        assert_eq!(names(&["/a/x", "/b/y/"]), ["x", "y"]);
        assert_eq!(names(&["/a/seq", "/b/seq", "/b/other"]), ["a/seq", "b/seq", "other"]);
        assert_eq!(names(&["/1/a/seq", "/2/a/seq", "/2/b/seq"]), ["1/a/seq", "2/a/seq", "b/seq"]);
        assert_eq!(names(&["/seq", "/b/seq"]), ["seq", "b/seq"]);
        assert_eq!(names(&["/a/seq", "/a/seq"]), ["a/seq", "a/seq"], "the same folder ends the search");
    }
}
