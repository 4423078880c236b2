//! `yfslam eval`.
#[derive(clap::Args, Debug)]
/// Eval.
pub struct EvalArgs {}
pub fn run(_: &EvalArgs) -> anyhow::Result<()> { anyhow::bail!("not yet") }
