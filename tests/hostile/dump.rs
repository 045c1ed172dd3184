//! Dumps as a stranger would make them: with a right checksum.

use super::common::meniscus;
use super::sandbox::text;
use meniscus::parameters::{JobId, PHYSICS_VERSION, Point};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// What stands before the state.
#[derive(Serialize, Deserialize)]
struct Header {
    format: u32,
    physics: u32,
    job: String,
}

/// A job at its beginning, and perhaps how it failed: class, reason, step.
#[derive(Serialize)]
struct Saved<'a> {
    point: &'a str,
    seed: u64,
    wall_s: f64,
    snapshot: Option<()>,
    failure: Option<(u32, &'a str, u64)>,
}

/// A folder for dumps of one job.
pub struct Dump {
    folder: tempfile::TempDir,
    point: String,
}

impl Dump {
    /// Of a deformable particle that ends soon.
    pub fn new() -> Self {
        let text = super::CAMPAIGN.replace("gamma = 1.0", "gamma = 1.0\nintegrator = \"implicit\"\ndt = 0.0625");
        let campaign = meniscus::campaign::file::Campaign::parse("letter.toml", &text).unwrap();
        let point = campaign.blocks[1].points[0].canonical();
        Self { folder: tempfile::tempdir().unwrap(), point }
    }

    pub fn path(&self) -> PathBuf {
        self.folder.path().join("dump.ckpt")
    }

    fn write(&self, point: &str, failure: Option<(u32, &str, u64)>) {
        let parsed: Result<Point, _> = serde_json::from_str(point);
        let id = JobId::new(parsed.unwrap().id(), 0).to_string();
        let header = postcard::to_stdvec(&Header { format: 1, physics: PHYSICS_VERSION, job: id }).unwrap();
        let state = postcard::to_stdvec(&Saved { point, seed: 0, wall_s: 0.0, snapshot: None, failure }).unwrap();
        let body = [header, state].concat();
        let bytes = [b"MENISCK1".as_slice(), blake3::hash(&body).as_bytes(), &body].concat();
        std::fs::write(self.path(), bytes).unwrap();
    }

    /// The dump of a job that failed for this reason.
    pub fn failed_with(self, reason: &str) -> Self {
        self.write(&self.point, Some((0, reason, 7)));
        self
    }

    /// What `replay` says of the dump with this part of its point changed.
    pub fn replayed_with(&self, from: &str, to: &str) -> String {
        assert!(self.point.contains(from), "{from} is not in {}", self.point);
        let point = if from.is_empty() { self.point.clone() } else { self.point.replace(from, to) };
        self.write(&point, Some((0, "unstable", 7)));
        let mut command = std::process::Command::new("timeout");
        command.arg("60").arg(meniscus(Path::new("."), &[]).get_program()).arg("replay").arg(self.path());
        let output = command.output().unwrap();
        assert!(matches!(output.status.code(), Some(0 | 1)), "{}: {}", output.status, text(&output));
        text(&output)
    }
}
