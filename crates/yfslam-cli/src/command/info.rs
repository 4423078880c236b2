//! `yfslam info`.
#[derive(clap::Args, Debug)]
/// Info.
pub struct InfoArgs {}
pub fn run(_: &InfoArgs) -> anyhow::Result<()> { anyhow::bail!("not yet") }
