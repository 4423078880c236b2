//! Dependencies run one way: between the folders of a crate, and between the crates of the workspace. The core's public surface is small.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Crates whose folders and files right below `src` must not depend on each other in a circle.
const CRATES: [&str; 9] = [
    "yfslam",
    "yfslam-detect",
    "yfslam-io",
    "yfslam-live",
    "yfslam-synth",
    "yfslam-eval",
    "yfslam-view",
    "yfslam-report",
    "yfslam-cli",
];

/// Layers of the workspace: a crate depends on crates of lower layers only. Crates that are not listed are above all of these.
const LAYERS: [&[&str]; 5] = [
    &["yfslam", "yfslam-eval"],
    &["yfslam-detect", "yfslam-io", "yfslam-live", "yfslam-synth"],
    &["yfslam-view"],
    &["yfslam-report"],
    &["yfslam-bench", "yfslam-cli"],
];

/// Most public functions that the core may have. Its lint `unreachable_pub` makes each `pub fn` a function that users can reach.
const PUBLIC_FUNCTIONS: usize = 120;

/// What depends on what.
type Graph = BTreeMap<String, BTreeSet<String>>;

fn workspace() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

#[test]
fn folders_of_a_crate_depend_on_each_other_in_one_direction() {
    for name in CRATES {
        let graph = modules(&workspace().join("crates").join(name).join("src"));
        assert!(graph.len() > 1, "{name}: no modules found");
        assert_eq!(circle(&graph), None, "{name}: these modules depend on each other in a circle");
    }
}

#[test]
fn crates_depend_on_lower_layers_only() {
    let graph = crates(&workspace().join("crates"));
    assert!(graph.len() >= 6, "{graph:?}");
    assert_eq!(circle(&graph), None, "these crates depend on each other in a circle");
    let layer = |name: &str| LAYERS.iter().position(|layer| layer.contains(&name)).unwrap_or(LAYERS.len());
    for (name, used) in &graph {
        for other in used {
            let in_order = layer(other) < layer(name) || layer(name) == LAYERS.len();
            assert!(in_order, "{name} must not depend on {other}");
        }
    }
}

#[test]
fn the_public_surface_of_the_core_stays_small() {
    let src = workspace().join("crates/yfslam/src");
    let root = fs::read_to_string(src.join("lib.rs")).unwrap();
    assert!(root.contains("#![deny(unreachable_pub)]"), "without this lint the count below means nothing");
    let mut files = Vec::new();
    list_files(&src, &mut files);
    let count = |file: &PathBuf| {
        let code = without_tests_and_comments(&fs::read_to_string(file).unwrap());
        let starts = ["pub fn ", "pub const fn ", "pub unsafe fn "];
        code.lines().filter(|line| starts.iter().any(|start| line.trim_start().starts_with(start))).count()
    };
    let functions: usize = files.iter().map(count).sum();
    assert!((1..=PUBLIC_FUNCTIONS).contains(&functions), "{functions} public functions, at most {PUBLIC_FUNCTIONS}");
}

/// Returns a circle of dependencies, if there is one.
fn circle(graph: &Graph) -> Option<Vec<String>> {
    fn visit(graph: &Graph, path: &mut Vec<String>, done: &mut BTreeSet<String>) -> Option<Vec<String>> {
        let node = path.last()?.clone();
        for next in graph.get(&node).into_iter().flatten() {
            if let Some(start) = path.iter().position(|earlier| earlier == next) {
                return Some(path[start..].to_vec());
            }
            if !done.contains(next) {
                path.push(next.clone());
                if let Some(circle) = visit(graph, path, done) {
                    return Some(circle);
                }
                path.pop();
            }
        }
        done.insert(node);
        None
    }
    let mut done = BTreeSet::new();
    graph.keys().find_map(|node| visit(graph, &mut vec![node.clone()], &mut done))
}

/// Returns the dependencies between the crates in a folder; those of tests are left out.
fn crates(folder: &Path) -> Graph {
    let mut graph = Graph::new();
    for entry in fs::read_dir(folder).unwrap() {
        let Ok(text) = fs::read_to_string(entry.unwrap().path().join("Cargo.toml")) else { continue };
        let manifest: toml::Table = text.parse().unwrap();
        let name = manifest["package"]["name"].as_str().unwrap().to_owned();
        let tables = ["dependencies", "build-dependencies"].map(|key| manifest.get(key).and_then(|t| t.as_table()));
        let names = tables.into_iter().flatten().flat_map(|table| table.keys());
        graph.insert(name, names.filter(|name| name.starts_with("yfslam")).cloned().collect());
    }
    graph
}

/// Returns the dependencies between the modules at the root of a crate.
fn modules(src: &Path) -> Graph {
    let mut files = Vec::new();
    list_files(src, &mut files);
    let root = ["lib.rs", "main.rs"].map(|name| fs::read_to_string(src.join(name)).unwrap_or_default()).concat();
    let module_of = |file: &Path| -> Vec<String> {
        let path = file.strip_prefix(src).unwrap().with_extension("");
        path.iter().map(|part| part.to_string_lossy().into_owned()).filter(|part| part != "mod").collect()
    };
    let names: BTreeSet<String> = files.iter().filter_map(|file| module_of(file).first().cloned()).collect();
    let exported = exported_items(&without_tests_and_comments(&root), &names);
    let mut graph = Graph::new();
    for file in &files {
        let module = module_of(file);
        let Some(name) = module.first().filter(|name| !["lib", "main"].contains(&name.as_str())) else { continue };
        let code = without_tests_and_comments(&fs::read_to_string(file).unwrap());
        let used = graph.entry(name.clone()).or_default();
        for item in items_at_root(&code, module.len()) {
            let target = if names.contains(&item) { Some(&item) } else { exported.get(&item) };
            used.extend(target.filter(|target| *target != name).cloned());
        }
    }
    graph
}

fn list_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            list_files(&path, files);
        } else if path.extension().is_some_and(|extension| extension == "rs") && !is_test_module(folder, &path) {
            files.push(path);
        }
    }
}

/// Returns whether the folder's own module declares a file for tests only.
fn is_test_module(folder: &Path, file: &Path) -> bool {
    let name = file.file_stem().unwrap().to_string_lossy();
    let parents = [folder.join("mod.rs"), folder.join("lib.rs"), folder.join("main.rs"), folder.with_extension("rs")];
    let declarations = ["", "pub(crate) "].map(|visible| format!("#[cfg(test)]\n{visible}mod {name};"));
    let text = parents.map(|parent| fs::read_to_string(parent).unwrap_or_default()).concat();
    declarations.iter().any(|declaration| text.contains(declaration))
}

/// Removes comments, and items that are compiled for tests only.
fn without_tests_and_comments(text: &str) -> String {
    let lines = text.lines().map(|line| line.split_once("//").map_or(line, |(code, _)| code));
    let code = lines.collect::<Vec<_>>().join("\n");
    let mut rest = code.as_str();
    let mut kept = String::new();
    while let Some((before, after)) = rest.split_once("#[cfg(").filter(|_| rest.contains("#[cfg(")) {
        kept += before;
        let (condition, item) = after.split_once(")]").unwrap();
        let is_test = condition == "test" || condition.starts_with("all(test");
        rest = if is_test { after_item(item) } else { item };
    }
    kept + rest
}

/// Returns what follows the first item of `text`: a semicolon ends it, or a block.
fn after_item(text: &str) -> &str {
    let mut depth = 0;
    for (index, c) in text.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if depth == 0 && (c == '}' || c == ';') {
            return &text[index + 1..];
        }
    }
    ""
}

/// Returns the names that follow a path to the root of the crate, in a module so many levels below it.
fn items_at_root(code: &str, depth: usize) -> Vec<String> {
    let to_root = "super::".repeat(depth);
    let mut items = Vec::new();
    for prefix in ["crate::", to_root.as_str()] {
        for (index, _) in code.match_indices(prefix) {
            let before = code[..index].chars().next_back();
            let is_path_start = before.is_none_or(|c| !c.is_alphanumeric() && c != '_' && c != ':');
            if is_path_start {
                items.extend(first_names(&code[index + prefix.len()..]));
            }
        }
    }
    items
}

/// Returns the first name of a path, or of each path in a group.
fn first_names(path: &str) -> Vec<String> {
    let Some(group) = path.strip_prefix('{') else { return name_at(path).into_iter().collect() };
    let mut depth = 0;
    let mut names: Vec<String> = name_at(group).into_iter().collect();
    for (index, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth == 0 => break,
            '}' => depth -= 1,
            ',' if depth == 0 => names.extend(name_at(&group[index + 1..])),
            _ => {}
        }
    }
    names
}

fn name_at(text: &str) -> Option<String> {
    let name: String = text.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
    (!name.is_empty()).then_some(name)
}

/// Returns the module of each item that the root of a crate re-exports with `pub use module::…`.
fn exported_items(root: &str, modules: &BTreeSet<String>) -> BTreeMap<String, String> {
    let mut items = BTreeMap::new();
    for statement in root.split("use ").skip(1).filter_map(|rest| rest.split(';').next()) {
        let path = statement.trim_start_matches("crate::").trim_start_matches("self::");
        let Some(module) = name_at(path).filter(|name| modules.contains(name)) else { continue };
        let words = path.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty());
        items.extend(words.map(|word| (word.to_owned(), module.clone())));
    }
    items
}

#[test]
fn a_circle_is_found_and_imports_of_tests_are_ignored() {
    let code = "use crate::{a::{x, y}, b};\n// crate::c\nfn f() { crate::d::g(); super::super::e::h() }\n\
                #[cfg(test)]\nmod tests { use crate::t; }\nuse crate::f;";
    let code = without_tests_and_comments(code);
    assert_eq!(items_at_root(&code, 2), ["a", "b", "d", "f", "e"]);
    let graph = |arrows: &[(&str, &str)]| {
        let mut graph = Graph::new();
        for (from, to) in arrows {
            graph.entry((*from).to_owned()).or_default().insert((*to).to_owned());
        }
        graph
    };
    assert_eq!(circle(&graph(&[("a", "b"), ("b", "c"), ("a", "c")])), None);
    assert!(circle(&graph(&[("a", "b"), ("b", "c"), ("c", "b")])).is_some());
}
