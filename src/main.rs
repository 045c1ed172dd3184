//! `meniscus`: parse, run, exit code.

mod cli;

use clap::Parser;
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = cli::Cli::parse();
    cli::talk(&cli);
    match cli.run() {
        Ok(exit) => exit.into(),
        Err(error) => {
            cli::complain(error.as_ref());
            cli::Exit::Error.into()
        }
    }
}
