//! `meniscus threshold CAMPAIGN.toml`: which of its droplets can pass, by statics alone.

use crate::campaign::file::Campaign;
use crate::cli::output::deliver;
use crate::cli::talk::{say, typed};
use crate::cli::{CommandResult, picture_kind, write_picture};
use crate::report::threshold::{COLUMNS, rows, svg, text};
use crate::store::{Format, write_rows};
use crate::study::threshold::throats;
use std::io::Write;
use std::path::PathBuf;

/// Arguments of `threshold`.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
For each channel of the campaign, and for the narrowest gap of its obstacle arrays, it computes P(h), the least perimeter
of a droplet whose centroid is held at h. A droplet passes if and only if gamma < Gamma_c = M/max dP/dh. Nothing is run:
walls are hard and smooth, and neither drag nor inertia play a part. The plot shows P(h), and dP/dh with the lines
M/gamma of the campaign: a droplet stops where its line meets the curve.

Example:

  meniscus threshold campaigns/channel_profiles.toml -o threshold.png")]
pub(super) struct Arguments {
    /// The campaign file
    campaign: PathBuf,
    /// How to write the thresholds: table, or a row for each tension in each scene as csv, json or parquet
    #[arg(long, default_value = "table")]
    format: Format,
    /// Draw the plot: .svg or .png
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

impl Arguments {
    /// Runs the subcommand.
    pub(super) fn run(&self, quiet: bool) -> CommandResult {
        self.output.as_deref().map(picture_kind).transpose()?;
        let campaign = Campaign::load(&self.campaign)?;
        let scenes = throats(&campaign)?;
        if let Some(path) = &self.output {
            let picture = svg(&format!("Least perimeter of a held droplet: {}", campaign.name), &scenes);
            write_picture(path, &picture)?;
            if !quiet {
                say(format!("wrote {}", typed(path)));
            }
        }
        deliver(self.format, None, |out: &mut dyn Write| match self.format {
            Format::Table => out.write_all(text(&scenes).as_bytes()),
            format => write_rows(&COLUMNS, rows(&scenes), format, out),
        })
    }
}
