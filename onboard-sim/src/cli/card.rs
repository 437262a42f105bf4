//! `onboard-sim card`.
use std::process::ExitCode;
use clap::Args;
use super::choices::Choices;
#[derive(Args)]
pub(crate) struct CardArguments {
    #[command(flatten)]
    choices: Choices,
}
pub(crate) fn run(arguments: &CardArguments) -> anyhow::Result<ExitCode> {
    let _ = arguments.choices.of_a_campaign();
    Ok(ExitCode::SUCCESS)
}
