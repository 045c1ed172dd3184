//! `meniscus completions SHELL`, `meniscus man` and `meniscus schema`: what shells, `man` and editors read.

use crate::campaign::file::schema::schema;
use crate::cli::talk::{print, print_data, write_file};
use crate::cli::{Cli, CommandResult, Exit};
use crate::parameters::shown;
use clap::CommandFactory;
use clap_complete::Shell;
use clap_mangen::Man;
use std::path::PathBuf;

/// Arguments of `completions`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
bash:  meniscus completions bash > ~/.local/share/bash-completion/completions/meniscus
zsh:   meniscus completions zsh > DIR/_meniscus, for a folder DIR in $fpath
fish:  meniscus completions fish > ~/.config/fish/completions/meniscus.fish")]
pub(super) struct Completions {
    /// The shell
    shell: Shell,
}

/// Arguments of `man`.
#[derive(Debug, clap::Args)]
#[command(after_help = "Read one:  meniscus man | man -l -")]
pub(super) struct Manual {
    /// Write one page for each subcommand into this folder, in place of the main page to stdout
    folder: Option<PathBuf>,
}

/// Arguments of `schema`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Editors that know TOML (Even Better TOML, taplo) complete and check a campaign file whose first line names the schema:
  meniscus schema > campaign.schema.json
  #:schema ./campaign.schema.json")]
pub(super) struct Schema {}

impl Completions {
    /// Runs the subcommand.
    pub(super) fn run(&self) -> CommandResult {
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "meniscus", &mut script);
        print_data(script)?;
        Ok(Exit::Done)
    }
}

impl Manual {
    /// Runs the subcommand.
    pub(super) fn run(&self) -> CommandResult {
        let mut command = Cli::command();
        command.build();
        let Some(folder) = &self.folder else {
            print_data(page(command)?)?;
            return Ok(Exit::Done);
        };
        std::fs::create_dir_all(folder).map_err(|error| format!("cannot make {}: {error}", shown(folder)))?;
        let subcommands: Vec<_> = command.get_subcommands().filter(|one| one.get_name() != "help").cloned().collect();
        for command in std::iter::once(command).chain(subcommands) {
            // Built commands know the whole name, `meniscus-run`.
            let name = command.get_display_name().unwrap_or(command.get_name()).to_owned();
            write_file(&folder.join(format!("{name}.1")), page(command)?)?;
        }
        Ok(Exit::Done)
    }
}

impl Schema {
    /// Runs the subcommand.
    pub(super) fn run(&self) -> CommandResult {
        print(serde_json::to_string_pretty(&schema())? + "\n")?;
        Ok(Exit::Done)
    }
}

/// A page of the manual.
fn page(command: clap::Command) -> std::io::Result<Vec<u8>> {
    let mut page = Vec::new();
    Man::new(command).render(&mut page)?;
    Ok(page)
}
