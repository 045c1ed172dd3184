//! `meniscus forget` as people use it: look, do it, compute anew, or take it back.
#![allow(clippy::unwrap_used, reason = "a test that cannot go on has failed")]

mod common;

use common::{CAMPAIGN, ask, expect, meniscus, results};
use std::fs;
use std::path::Path;
use std::process::{Output, Stdio};

const STORE: &str = "both";

/// A store with the campaign `small`, and with `wide`, which plans the half of its jobs too and others of its own.
fn both() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let wide = CAMPAIGN
        .replace("name = \"small\"", "name = \"wide\"")
        .replace("gamma = [0.3, 1.0]", "gamma = [1.0, 1.2]")
        .replace("e_w = [1.0, 30.0]", "e_w = [30.0, 40.0]");
    fs::write(folder.path().join("small.toml"), CAMPAIGN).unwrap();
    fs::write(folder.path().join("wide.toml"), wide).unwrap();
    for file in ["small.toml", "wide.toml"] {
        expect(0, folder.path(), &["run", file, "--store", STORE, "--quiet"]);
    }
    folder
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn said(output: &Output) -> String {
    text(&output.stdout) + &text(&output.stderr)
}

fn counts(dir: &Path, store: &str) -> String {
    ask(dir, store, "select campaign, state, count(*) from runs group by 1, 2 order by 1")
}

#[test]
fn jobs_that_another_campaign_only_found_done_stay_with_it() {
    let folder = both();
    let dir = folder.path();
    let part = CAMPAIGN.replace("name = \"small\"", "name = \"part\"").replace("gamma = [0.3, 1.0]", "gamma = [0.3]");
    fs::write(dir.join("part.toml"), part).unwrap();
    expect(0, dir, &["run", "part.toml", "--store", STORE, "--quiet"]);
    expect(0, dir, &["forget", STORE, "small", "--yes"]);
    let left = counts(dir, STORE);
    assert!(left.contains("part,done,"), "{left}");
    let again = said(&expect(0, dir, &["run", "part.toml", "--store", STORE]));
    assert!(again.contains("jobs are done"), "{again}");
}

#[test]
fn a_forgotten_campaign_is_computed_anew_with_the_same_bits_and_its_copy_is_a_store() {
    let folder = both();
    let dir = folder.path();
    let before = results(dir, STORE);
    assert_eq!(counts(dir, STORE), "campaign,state,count(*)\nsmall,done,24\nwide,done,12\n");

    let looked = said(&expect(0, dir, &["forget", STORE, "small"]));
    for words in ["jobs that go: 12 (12 done)", "because wide plans them too: 12", "points that go: 2"] {
        assert!(looked.contains(words), "{looked}");
    }
    assert!(looked.contains("nothing has changed; next: meniscus forget both small --yes"), "{looked}");
    assert!(results(dir, STORE) == before && !dir.join(STORE).join("quarantine").exists());

    let done = said(&expect(0, dir, &["forget", STORE, "small", "--yes"]));
    let copy = "both/quarantine/forgotten-small-1";
    assert!(done.contains(&format!("`meniscus status {copy}` reads it")), "{done}");
    assert_eq!(counts(dir, STORE), "campaign,state,count(*)\nwide,done,24\n");
    assert_eq!(counts(dir, copy), "campaign,state,count(*)\nsmall,done,24\n");
    expect(0, dir, &["check", STORE]);
    expect(0, dir, &["check", copy]);
    expect(0, dir, &["fit", STORE]);

    // The copy is all that the campaign was: a run of it has nothing left to do.
    fs::rename(dir.join(copy), dir.join("taken-back")).unwrap();
    let again = said(&expect(0, dir, &["run", "small.toml", "--store", "taken-back"]));
    assert!(again.contains("all 24 jobs are done"), "{again}");

    expect(0, dir, &["run", "small.toml", "--store", STORE, "--quiet"]);
    assert!(results(dir, STORE) == before, "other bits than before");
    assert!(results(dir, "taken-back")[0].lines().all(|run| before[0].contains(run)));
    expect(0, dir, &["check", STORE]);
}

#[test]
fn what_cannot_be_forgotten_is_said_with_what_can_be_done() {
    let folder = both();
    let dir = folder.path();
    let unknown = said(&expect(1, dir, &["forget", STORE, "smal"]));
    assert!(
        unknown.contains("no campaign `smal`; it has `small` (id ") && unknown.contains("`wide` (id "),
        "{unknown}"
    );
    let nowhere = said(&expect(1, dir, &["forget", "nowhere", "small"]));
    assert!(nowhere.contains("no store at nowhere"), "{nowhere}");

    let endless = CAMPAIGN.replace("\"small\"", "\"endless\"").replace("t_max = 400.0", "t_max = 1e9");
    let endless = endless.replace("sample_every = 2.0", "sample_every = 1000.0");
    let endless = endless.replace("distance = 6.0", "distance = \"none\"").replace("density = 0.7", "density = 0.01");
    fs::write(dir.join("endless.toml"), endless).unwrap();
    let mut run = meniscus(dir, &["run", "endless.toml", "--store", STORE, "--quiet"]);
    let mut run = run.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    while !counts(dir, STORE).contains("running") {
        std::thread::sleep(std::time::Duration::from_millis(10));
        assert!(run.try_wait().unwrap().is_none(), "the run goes on");
    }
    let refused = said(&expect(1, dir, &["forget", STORE, "small", "--yes"]));
    assert!(refused.contains(&format!("process {}", run.id())) && refused.contains("wait for it"), "{refused}");
    run.kill().unwrap();
    run.wait().unwrap();
    assert!(counts(dir, STORE).contains("small,done,24"), "nothing has gone");
    // A killed run, with jobs under way, is no hindrance.
    expect(0, dir, &["forget", STORE, "endless", "--yes"]);
    assert_eq!(counts(dir, STORE), "campaign,state,count(*)\nsmall,done,24\nwide,done,12\n");
    assert!(counts(dir, "both/quarantine/forgotten-endless-1").contains("endless,pending,24"));
    expect(0, dir, &["check", STORE]);
}
