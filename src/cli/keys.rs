//! `meniscus keys [NAME]`: what may stand in a campaign file.

use crate::campaign::file::nearest;
use crate::cli::talk::print;
use crate::cli::{CommandResult, Exit};
use crate::report::keys;
use crate::report::text_table::hanging;

/// Arguments of `keys`.
#[derive(Debug, clap::Args)]
pub(super) struct Arguments {
    /// A key or a table, such as gamma or grid; without it, all are listed
    name: Option<String>,
    /// Everything as a Markdown page, docs/keys.md
    #[arg(long, conflicts_with = "name")]
    markdown: bool,
}

impl Arguments {
    /// Runs the subcommand.
    pub(super) fn run(&self) -> CommandResult {
        let text = match &self.name {
            None if self.markdown => keys::markdown(),
            None => hanging(&keys::all(), keys::NAMES + 2),
            Some(name) => hanging(&keys::one(name).ok_or_else(|| unknown(name))?, keys::NAMES),
        };
        print(text)?;
        Ok(Exit::Done)
    }
}

fn unknown(name: &str) -> String {
    let meant = nearest(name, keys::names()).map_or_else(String::new, |meant| format!("did you mean `{meant}`? "));
    format!("no key `{name}`: {meant}`meniscus keys` lists all")
}
