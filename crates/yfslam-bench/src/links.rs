//! Finds relative links of Markdown pages that lead nowhere.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result};

/// Folders that are not part of the project.
const LEFT_OUT: [&str; 4] = ["target", "out", "node_modules", "shared"];

/// Relative links in all Markdown files under `root` whose targets are not there, as `FILE: LINK`.
///
/// # Errors
/// A folder or a file cannot be read.
pub fn broken(root: &Path) -> Result<Vec<String>> {
    let mut found = Vec::new();
    for page in pages(root)? {
        let text = std::fs::read_to_string(&page).with_context(|| format!("cannot read {}", page.display()))?;
        for link in links(&text) {
            let target = link.split(['#', '?']).next().unwrap_or_default();
            let folder = page.parent().unwrap_or(root);
            if !target.is_empty() && !folder.join(target).exists() {
                found.push(format!("{}: {link}", page.strip_prefix(root).unwrap_or(&page).display()));
            }
        }
    }
    Ok(found)
}

/// All Markdown files of the project, in order.
fn pages(folder: &Path) -> Result<Vec<PathBuf>> {
    let mut entries = std::fs::read_dir(folder)
        .with_context(|| format!("cannot read {}", folder.display()))?
        .map(|entry| Ok(entry?.path()))
        .collect::<Result<Vec<_>>>()?;
    entries.sort();
    let mut found = Vec::new();
    for path in entries {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if path.is_symlink() || LEFT_OUT.contains(&&*name) || name.starts_with('.') && name != ".github" {
            continue;
        }
        if path.is_dir() {
            found.extend(pages(&path)?);
        } else if path.extension().is_some_and(|extension| extension == "md") {
            found.push(path);
        }
    }
    Ok(found)
}

/// Targets of the relative links and images of a page. Code is left out.
fn links(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut fenced = false;
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            fenced = !fenced;
        }
        if fenced || line.starts_with("    ") {
            continue;
        }
        // Every second part between backquotes is code.
        let prose: String = line.split('`').step_by(2).collect::<Vec<_>>().join("`");
        for rest in prose.split("](").skip(1) {
            let Some((target, _)) = rest.split_once(')') else { continue };
            let target = target.split_whitespace().next().unwrap_or_default();
            if !target.contains("://") && !target.starts_with("mailto:") {
                found.push(target.to_owned());
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn relative_links_outside_of_code_are_found() {
        let text = "See [a](a.md#part), ![b](img/b.png \"title\") and [web](https://example.org).\n`[c](c.md)`\n    [d](d.md)\n```\n[e](e.md)\n```\n";
        assert_eq!(links(text), ["a.md#part", "img/b.png"]);
    }

    #[test]
    fn a_link_to_a_missing_page_is_named_with_its_page() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::create_dir(folder.path().join("docs")).unwrap();
        std::fs::write(folder.path().join("docs/a.md"), "[there](b.md) [gone](c.md)").unwrap();
        std::fs::write(folder.path().join("docs/b.md"), "[up](../docs/a.md)").unwrap();
        assert_eq!(broken(folder.path()).unwrap(), ["docs/a.md: c.md"]);
    }
}
