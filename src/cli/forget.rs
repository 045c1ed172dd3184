//! `meniscus forget DIR CAMPAIGN`: says what goes with a campaign, and takes it out of the store if told to.

use crate::cli::talk::{print, say, typed};
use crate::cli::{CommandResult, Exit, whole_store};
use crate::parameters::plain;
use crate::store::{Forgotten, forget, forgettable};
use std::path::{Path, PathBuf};

/// Arguments of `forget`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
Jobs that another campaign of the store plans too stay, and belong to that one.
All else that the campaign brought goes to a store of its own,
DIR/quarantine/forgotten-CAMPAIGN-NUMBER: `meniscus query` asks it, and moving
that folder away makes it a store like any other. `meniscus run` with the same
campaign file computes it anew, with the same bits.")]
pub(super) struct Arguments {
    /// The store
    store: PathBuf,
    /// The campaign: its name, or an id of one of its texts (text_hash in the table campaigns; six characters suffice)
    campaign: String,
    /// Do it; without this, what would go is only said
    #[arg(long)]
    yes: bool,
}

impl Arguments {
    /// Runs the subcommand.
    pub(super) fn run(&self, quiet: bool) -> CommandResult {
        let dir = whole_store(&self.store);
        print(described(&forgettable(&dir, &self.campaign)?, &dir, self.yes))?;
        if !self.yes {
            if !quiet {
                let campaign = typed(Path::new(&self.campaign));
                say(format!("nothing has changed; next: meniscus forget {} {campaign} --yes", typed(&dir)));
            }
            return Ok(Exit::Done);
        }
        let (_, place) = forget(&dir, &self.campaign)?;
        if !quiet {
            say(format!("forgotten; it lies in {0}, and `meniscus status {0}` reads it", typed(&place)));
        }
        Ok(Exit::Done)
    }
}

/// What goes and what stays, in words.
fn described(forgotten: &Forgotten, dir: &Path, now: bool) -> String {
    let Forgotten { campaign, texts, jobs, handed_over, points, fits, files, files_rewritten, unread } = forgotten;
    let mut text = String::new();
    let mut line = |words: String| text.extend([&*plain(&words), "\n"]);
    let texts = if *texts > 1 { format!(" with its {texts} texts") } else { String::new() };
    let go = if now { "goes" } else { "would go" };
    let states = [(jobs.done, "done"), (jobs.failed, "failed"), (jobs.running, "running"), (jobs.pending, "pending")];
    let states: Vec<String> =
        states.iter().filter(|(jobs, _)| *jobs > 0).map(|(jobs, state)| format!("{jobs} {state}")).collect();
    let states = if states.is_empty() { String::new() } else { format!(" ({})", states.join(", ")) };
    line(format!("campaign {campaign}{texts} {go} from {} to quarantine/", typed(dir)));
    line(format!("  jobs that go: {}{states}", jobs.jobs()));
    for (heir, jobs) in handed_over {
        line(format!("  jobs that stay, because {heir} plans them too: {jobs}"));
    }
    line(format!("  points that go: {points}"));
    line(format!("  sample files that go: {files}, and written anew without its rows: {files_rewritten}"));
    line(format!("  rows of fits that go, until the next `meniscus fit`: {fits}"));
    for name in unread {
        line(format!("  note: the text of {name} cannot be read, so jobs that only it shares go too"));
    }
    text
}
