//! Every function of the header is exported, and every exported function is in the header.

use std::collections::BTreeSet;

use super::HEADER;
use crate::exports::{library, recording, results, slam};

#[test]
fn header_and_library_have_the_same_functions() {
    let code = without_comments(HEADER);
    let declared: BTreeSet<&str> = code
        .split(|c: char| !c.is_alphanumeric() && c != '_' && c != '(')
        .filter_map(|word| word.split_once('('))
        .map(|(name, _)| name)
        .filter(|name| name.starts_with("yfslam_"))
        .collect();
    let all = [library::NAMES, slam::NAMES, results::NAMES, recording::NAMES];
    let exported: BTreeSet<&str> = all.into_iter().flatten().copied().collect();
    assert!(exported.len() > 20, "{exported:?}");
    assert_eq!(declared, exported);
}

fn without_comments(text: &str) -> String {
    let (mut kept, mut rest) = (String::new(), text);
    while let Some((before, after)) = rest.split_once("/*") {
        kept += before;
        rest = after.split_once("*/").map_or("", |(_, after)| after);
    }
    kept + rest
}
