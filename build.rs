//! Tells the program what it was built from, for the provenance of every run.

use std::process::Command;

fn main() {
    let output = |program: &str, arguments: &[&str]| {
        let output = Command::new(program).args(arguments).output().ok().filter(|o| o.status.success())?;
        Some(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    };
    let unknown = || "unknown".to_owned();
    let commit = output("git", &["rev-parse", "--short=12", "HEAD"]).unwrap_or_else(unknown);
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
    println!("cargo::rustc-env=MENISCUS_COMMIT={commit}");
    println!("cargo::rustc-env=MENISCUS_RUSTC={}", output(&rustc, &["--version"]).unwrap_or_else(unknown));
    // Written by every commit and checkout; a file that is not there would start this script at every build.
    for name in ["HEAD", "logs/HEAD"] {
        // Elsewhere than in .git, for a work tree of its own.
        let path = output("git", &["rev-parse", "--git-path", name]).filter(|path| std::path::Path::new(path).exists());
        if let Some(path) = path {
            println!("cargo::rerun-if-changed={path}");
        }
    }
    println!("cargo::rerun-if-changed=build.rs");
}
