//! The pages of results are what the records give, and links of the documentation lead somewhere.

use yfslam_bench::{links, render, root};

#[test]
fn pages_of_results_agree_with_the_records() {
    render::check(&root()).unwrap();
}

#[test]
fn relative_links_of_all_pages_lead_somewhere() {
    let broken = links::broken(&root()).unwrap();
    assert!(broken.is_empty(), "links that lead nowhere:\n{}", broken.join("\n"));
}
