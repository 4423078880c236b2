//! `yfslam demo`.
#[derive(clap::Args, Debug)]
/// Demo.
pub struct DemoArgs {}
pub fn run(_: &DemoArgs, _: crate::terminal::Terminal) -> anyhow::Result<()> { anyhow::bail!("not yet") }
