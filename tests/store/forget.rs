//! A campaign that is forgotten goes alone, lies whole in quarantine, and takes nothing of others with it.

use super::make::*;
use meniscus::campaign::file::{Block, Campaign};
use meniscus::parameters::JobId;
use meniscus::results::trajectory::FailureClass;
use meniscus::store::{
    CampaignRecord, PlannedPoint, Provenance, StateCounts, Store, StoreError, Writer, check, checkpoint_file, forget,
    forgettable, point_runs, save_fits, status,
};
use meniscus::study::fits::fit_all;
use std::ops::Range;
use std::path::{Path, PathBuf};

const ROWS: usize = 20;

/// A campaign of soft particles: its name, its stiffnesses, its further keys.
fn campaign(name: &str, e_w: &str, keys: &str) -> Campaign {
    let text = format!(
        "name = \"{name}\"\nmodel = \"SP\"\nscene = \"obstacles\"\nw_ob = 0.2\nsigma_ob = 0.3\ndensity = 0.35\n{keys}\n\
         [[block]]\nname = \"of-{name}\"\ngrid.e_w = {e_w}\n"
    );
    Campaign::parse(name, &text).unwrap_or_else(|errors| panic!("{}", errors.render(false)))
}

/// Registers these seeds of a campaign, as a round of a run does, and brings all pending jobs of it to an end but those
/// of the seeds `left`. Seed 2 fails. Commits `batch` outcomes at a time.
fn run(dir: &Path, campaign: &Campaign, seeds: Range<u64>, left: Range<u64>, batch: usize) {
    let block: &Block = &campaign.blocks[0];
    let points = block.points.iter().zip(&block.point_ids);
    let plan: Vec<_> = points
        .map(|(point, &point_id)| PlannedPoint { point, point_id, seeds: seeds.clone(), block: &block.name })
        .collect();
    let mut store = Store::open(dir).unwrap();
    let record = CampaignRecord { name: &campaign.name, text: &campaign.text };
    let key = store.register(&record, &plan).unwrap().campaign;
    let who =
        Provenance { program_version: "", git_commit: &campaign.name, rustc: "", cpu_features: "", campaign: key };
    store.begin_run(&who).unwrap();
    // Never merged, so that it is known which files there are.
    let options = meniscus::store::WriterOptions { merge: usize::MAX, ..options(batch) };
    let writer = Writer::spawn(store, options).unwrap();
    for planned in &plan {
        for seed in seeds.clone().filter(|seed| !left.contains(seed)) {
            let message = match seed {
                2 => failed(planned.point, seed, FailureClass::Unstable),
                _ => finished(planned.point, seed, ROWS),
            };
            writer.sender().send(message).unwrap();
        }
    }
    drop(writer.finish().unwrap());
}

/// All that a store holds of physics.
fn contents(dir: &Path) -> [Vec<String>; 5] {
    [
        "SELECT job_id, point_id, e_w, seed, state, outcome, r_end, v_g_mean, steps, error FROM runs ORDER BY job_id",
        "SELECT * FROM clog_events ORDER BY job_id",
        "SELECT job_id, t, hex(vertices), loads FROM shapes ORDER BY job_id, t",
        "SELECT * FROM samples ORDER BY job_id, t",
        "SELECT * FROM stability ORDER BY job_id",
    ]
    .map(|sql| csv(dir, sql))
}

/// Whose the jobs are: number of jobs by campaign and block.
fn owners(dir: &Path) -> Vec<String> {
    csv(dir, "SELECT campaign, block, count(*) FROM runs GROUP BY 1, 2 ORDER BY 1")
}

/// Forgets a campaign; what is left is sound, and so is the store that it lies in, which is returned.
fn forgotten(dir: &Path, campaign: &str) -> PathBuf {
    let expected = forgettable(dir, campaign).unwrap();
    let (told, place) = forget(dir, campaign).unwrap();
    assert_eq!(told, expected, "what was said before is what was done");
    for store in [dir, &place] {
        assert_eq!(check(store).unwrap().findings, [], "{}", store.display());
    }
    let files = std::fs::read_dir(dir.join("samples")).unwrap().count();
    assert_eq!(csv(dir, "SELECT count(*) FROM sample_files"), [files.to_string()]);
    place
}

fn scratch_of(campaigns: &[&Campaign]) -> tempfile::TempDir {
    let dir = scratch();
    campaigns.iter().for_each(|campaign| run(dir.path(), campaign, 0..campaign.blocks[0].seeds.end, 0..0, 5));
    dir
}

#[test]
fn what_two_campaigns_share_stays_with_the_other_whichever_brought_it() {
    let first = campaign("first", "[1.0, 2.0]", "runs_per_point = 4");
    let second = campaign("second", "[2.0, 3.0]", "runs_per_point = 6");
    let alone = [&first, &second].map(|only| contents(scratch_of(&[only]).path()));
    for (goes, stays) in [(0, 1), (1, 0)] {
        let (names, jobs) = (["first", "second"], [8, 12]);
        let dir = scratch_of(&[&first, &second]);
        assert_eq!(owners(dir.path()), ["first,of-first,8", "second,of-second,8"], "the first has what they share");
        let place = forgotten(dir.path(), names[goes]);
        let owner = |of: usize| [format!("{0},of-{0},{1}", names[of], jobs[of])];
        assert_eq!(owners(dir.path()), owner(stays));
        assert_eq!(owners(&place), owner(goes), "the copy has what they share too");
        assert!(contents(dir.path()) == alone[stays], "{} lost something", names[stays]);
        assert!(contents(&place) == alone[goes], "{} is not whole in quarantine", names[goes]);
        assert_eq!(place, dir.path().join(format!("quarantine/forgotten-{}-1", names[goes])));
        // It is computed as before, and can then be forgotten again.
        run(dir.path(), [&first, &second][goes], 0..6 - 2 * (1 - goes as u64), 0..0, 5);
        assert!(contents(dir.path()) == contents(scratch_of(&[&first, &second]).path()));
        assert!(forgotten(dir.path(), names[goes]).ends_with(format!("forgotten-{}-2", names[goes])));
    }
}

#[test]
fn files_of_one_campaign_alone_are_moved_and_shared_ones_are_written_anew() {
    let (first, second) =
        (campaign("first", "[1.0]", "runs_per_point = 6"), campaign("second", "[1.0]", "runs_per_point = 4"));
    let dir = scratch();
    // Seeds 0, 1, 3 | 4, 5: the first file is shared in part.
    run(dir.path(), &first, 0..6, 0..0, 4);
    run(dir.path(), &second, 0..4, 0..0, 4);
    let before = csv(dir.path(), "SELECT path FROM sample_files ORDER BY key");
    let told = forgettable(dir.path(), "first").unwrap();
    assert_eq!((told.files, told.files_rewritten, before.len()), (1, 0, 2), "{before:?}");
    assert_eq!(told.jobs, StateCounts { done: 2, ..StateCounts::default() });
    assert_eq!(told.handed_over.into_iter().collect::<Vec<_>>(), [("second".to_owned(), 4)]);
    let place = forgotten(dir.path(), "first");
    assert_eq!(csv(dir.path(), "SELECT path FROM sample_files"), before[..1], "a file without its rows stays as it is");
    assert_eq!(csv(&place, "SELECT path FROM sample_files ORDER BY key"), before);

    let third = campaign("third", "[1.0]", "runs_per_point = 2");
    run(dir.path(), &third, 0..2, 0..0, 4);
    let told = forgettable(dir.path(), "second").unwrap();
    assert_eq!((told.files, told.files_rewritten), (0, 1));
    forgotten(dir.path(), "second");
    assert_ne!(csv(dir.path(), "SELECT path FROM sample_files"), before[..1]);
    assert_eq!(csv(dir.path(), "SELECT count(*), count(DISTINCT job_id) FROM samples"), [format!("{},2", 2 * ROWS)]);
}

#[test]
fn a_damaged_file_stops_it_before_anything_goes() {
    let (first, second) =
        (campaign("first", "[1.0]", "runs_per_point = 6"), campaign("second", "[1.0]", "runs_per_point = 2"));
    let dir = scratch_of(&[&first, &second]);
    let path = dir.path().join(&csv(dir.path(), "SELECT path FROM sample_files")[0]);
    let sound = std::fs::read(&path).unwrap();
    let mut bytes = sound.clone();
    bytes[99] ^= 4;
    std::fs::write(&path, bytes).unwrap();
    let refusal = forget(dir.path(), "first").unwrap_err();
    assert!(matches!(refusal, StoreError::Damaged { .. }), "{refusal}");
    assert!(refusal.to_string().contains("--repair"), "{refusal}");
    std::fs::write(&path, sound).unwrap();
    assert_eq!(owners(dir.path()), ["first,of-first,6"]);
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM campaigns"), ["2"]);
    forgotten(dir.path(), "first");
}

#[test]
fn rounds_go_with_their_campaign_and_keep_what_a_round_of_another_may_reach() {
    let rounds = campaign("rounds", "[1.0]", "runs_per_point = 2\nuntil = { relative_error = 0.1, max_runs = 7 }");
    let plain = campaign("plain", "[1.0]", "runs_per_point = 10");
    let dir = scratch();
    run(dir.path(), &rounds, 0..2, 0..0, 5);
    run(dir.path(), &rounds, 0..4, 0..0, 5);
    run(dir.path(), &plain, 0..10, 0..0, 5);
    assert_eq!(owners(dir.path()), ["plain,of-plain,6", "rounds,of-rounds,4"]);
    let everything = contents(dir.path());
    let place = forgotten(dir.path(), "plain");
    assert_eq!(owners(dir.path()), ["rounds,of-rounds,7"], "the seeds below max_runs");
    assert!(contents(&place) == everything);

    let only = scratch();
    run(only.path(), &rounds, 0..2, 0..0, 5);
    run(only.path(), &rounds, 0..4, 0..0, 5);
    let all_rounds = contents(only.path());
    let place = forgotten(only.path(), "rounds");
    assert!(contents(&place) == all_rounds && owners(&place) == ["rounds,of-rounds,4"]);
    assert_eq!(owners(only.path()), [""; 0]);
}

#[test]
fn the_only_campaign_of_a_store_leaves_it_empty_and_of_use() {
    let only = campaign("only", "[1.0, 2.0]", "runs_per_point = 4");
    let dir = scratch_of(&[&only]);
    let before = contents(dir.path());
    let place = forgotten(dir.path(), "only");
    assert!(contents(&place) == before);
    let tables = csv(
        dir.path(),
        "SELECT (SELECT count(*) FROM campaigns) + (SELECT count(*) FROM points) + (SELECT count(*) FROM jobs)
              + (SELECT count(*) FROM outcomes) + (SELECT count(*) FROM provenance) + (SELECT count(*) FROM shape_rows)
              + (SELECT count(*) FROM clogs) + (SELECT count(*) FROM sample_files) + (SELECT count(*) FROM sample_index) AS n",
    );
    assert_eq!(tables, ["0"]);
    let empty = status(dir.path()).unwrap();
    assert_eq!((empty.total.jobs(), empty.campaigns.len(), empty.run), (0, 0, None));
    run(dir.path(), &only, 0..4, 0..0, 5);
    assert!(contents(dir.path()) == before);
}

#[test]
fn unfinished_and_failed_jobs_go_with_their_checkpoints_and_dumps() {
    let (goes, stays) =
        (campaign("goes", "[1.0]", "runs_per_point = 6"), campaign("stays", "[2.0]", "runs_per_point = 6"));
    let dir = scratch();
    let ckpt = |folder: &str, of: &Campaign, seed| {
        let job = JobId::new(of.blocks[0].point_ids[0], seed);
        let state = format!("{folder} {}", of.name);
        std::fs::create_dir_all(dir.path().join(folder)).unwrap();
        checkpoint_file::write(&dir.path().join(folder), job, state.as_bytes()).unwrap()
    };
    let files: Vec<_> = [&goes, &stays]
        .map(|campaign| {
            run(dir.path(), campaign, 0..6, 4..6, 5);
            [ckpt("checkpoints", campaign, 5), ckpt("dumps", campaign, 2)]
        })
        .concat();
    let bytes: Vec<_> = files.iter().map(|file| std::fs::read(file).unwrap()).collect();
    let place = forgotten(dir.path(), "goes");
    for (file, bytes) in files.iter().zip(&bytes) {
        let part = file.strip_prefix(dir.path()).unwrap();
        let (here, there) = if files[..2].contains(file) { (false, true) } else { (true, false) };
        assert_eq!((file.exists(), place.join(part).exists()), (here, there), "{}", part.display());
        assert!(std::fs::read(if here { file.clone() } else { place.join(part) }).unwrap() == *bytes);
    }
    assert_eq!(
        csv(dir.path(), "SELECT campaign, state, count(*) FROM runs GROUP BY 2"),
        ["stays,done,3", "stays,failed,1", "stays,pending,2"]
    );
}

#[test]
fn a_checkpoint_of_an_unknown_job_stays_unless_it_lies_in_quarantine() {
    let dir = scratch_of(&[&campaign("only", "[1.0]", "runs_per_point = 2")]);
    let folder = dir.path().join("checkpoints");
    let unknown = checkpoint_file::write(&folder, JobId::new(soft(7.0).id(), 0), b"somebody's").unwrap();
    drop(Store::open(dir.path()).unwrap());
    assert!(unknown.exists());
    let copy = dir.path().join("quarantine/forgotten-x-1/checkpoints").join(unknown.file_name().unwrap());
    std::fs::create_dir_all(copy.parent().unwrap()).unwrap();
    std::fs::copy(&unknown, copy).unwrap();
    drop(Store::open(dir.path()).unwrap());
    assert!(!unknown.exists(), "what a crash left of the campaign x");
}

#[test]
fn fits_made_with_runs_that_go_go_too_and_others_stay() {
    let (goes, stays) =
        (campaign("goes", "[1.0, 2.0]", "runs_per_point = 6"), campaign("stays", "[2.0, 3.0]", "runs_per_point = 4"));
    let dir = scratch_of(&[&goes, &stays]);
    let fit = |dir: &Path| {
        let mut store = Store::open(dir).unwrap();
        let points = point_runs(store.connection()).unwrap();
        let fits = fit_all(&points, 0.0);
        save_fits(&mut store, &fits).unwrap();
    };
    fit(dir.path());
    let fitted = |dir: &Path| {
        ["lambda_fits", "speed_averages"].map(|view| csv(dir, &format!("SELECT e_w, runs FROM {view} ORDER BY e_w")))
    };
    let of = |lines: [&str; 3]| lines.map(str::to_owned).to_vec();
    assert_eq!(fitted(dir.path()), [of(["1.0,5", "2.0,5", "3.0,3"]), of(["1.0,5", "2.0,5", "3.0,3"])]);
    let told = forgettable(dir.path(), "goes").unwrap();
    assert_eq!((told.points, told.fits), (1, 8), "of two points, decay length, speed and two steps of survival each");
    let place = forgotten(dir.path(), "goes");
    assert_eq!(fitted(dir.path()), [["3.0,3"], ["3.0,3"]]);
    assert_eq!(csv(dir.path(), "SELECT count(*) FROM points"), ["2"]);
    fit(dir.path());
    let alone = scratch_of(&[&stays]);
    fit(alone.path());
    let fits = "SELECT * FROM lambda_fits JOIN speed_averages USING (point_id) ORDER BY point_id";
    assert_eq!(csv(dir.path(), fits), csv(alone.path(), fits));
    assert_eq!(fitted(&place), [["1.0,5", "2.0,5"], ["1.0,5", "2.0,5"]]);

    // Where only jobs without a result go, the fits are as right as they were.
    let more = campaign("more", "[2.0]", "runs_per_point = 9");
    run(dir.path(), &more, 0..9, 4..9, 5);
    assert_eq!(forgettable(dir.path(), "more").unwrap().fits, 0);
    forgotten(dir.path(), "more");
    assert_eq!(csv(dir.path(), fits), csv(alone.path(), fits));
}

#[test]
fn a_name_stands_for_all_texts_of_a_campaign_and_an_id_for_one_and_others_are_listed() {
    let (old, new) =
        (campaign("grown", "[1.0]", "runs_per_point = 2"), campaign("grown", "[1.0, 2.0]", "runs_per_point = 4"));
    let other = campaign("other", "[3.0]", "runs_per_point = 2");
    let dir = scratch_of(&[&old, &new, &other]);
    let ids = csv(dir.path(), "SELECT substr(text_hash, 1, 10) FROM campaigns ORDER BY key");
    let refusal = forget(dir.path(), "grow").unwrap_err().to_string();
    for text in ["no campaign `grow`", &format!("`grown` (id {}, {})", ids[0], ids[1]), "`other`"] {
        assert!(refusal.contains(text), "{refusal}");
    }
    let place = forgotten(dir.path(), &ids[1]);
    assert_eq!(owners(dir.path()), ["grown,of-grown,2", "other,of-other,2"], "the older text is as it was");
    assert_eq!(csv(&place, "SELECT count(*) FROM runs"), ["8"]);

    let dir = scratch_of(&[&old, &new, &other]);
    assert_eq!(forgettable(dir.path(), "grown").unwrap().texts, 2);
    forgotten(dir.path(), "grown");
    assert_eq!(owners(dir.path()), ["other,of-other,2"]);
    let no_such = forget(dir.path(), "grown").unwrap_err();
    assert!(matches!(&no_such, StoreError::NoCampaign { asked, .. } if asked == "grown"), "{no_such}");
    assert!(matches!(forget(&dir.path().join("x"), "grown"), Err(StoreError::Missing(_))));
}

#[test]
fn a_run_of_the_campaign_that_computed_what_stays_is_told_as_one_of_the_other() {
    let (first, second) =
        (campaign("first", "[1.0]", "runs_per_point = 4"), campaign("second", "[1.0]", "runs_per_point = 2"));
    let dir = scratch_of(&[&first, &second]);
    forgotten(dir.path(), "first");
    let runs = "SELECT git_commit, campaigns.name, count(outcomes.job) FROM provenance
                JOIN campaigns ON campaigns.key = provenance.campaign
                LEFT JOIN outcomes ON outcomes.provenance = provenance.key GROUP BY provenance.key";
    assert_eq!(csv(dir.path(), runs), ["first,second,2", "second,second,0"], "the commit is that of the first");
}

#[test]
fn a_text_that_cannot_be_read_is_named_because_nobody_knows_what_it_plans() {
    let dir = scratch_of(&[&campaign("first", "[1.0]", "runs_per_point = 2")]);
    let mut store = Store::open(dir.path()).unwrap();
    store.register(&CampaignRecord { name: "odd", text: "of another program" }, &[]).unwrap();
    drop(store);
    assert_eq!(forgettable(dir.path(), "first").unwrap().unread, ["odd"]);
    assert_eq!(forgettable(dir.path(), "odd").unwrap().unread, [""; 0]);
    forgotten(dir.path(), "odd");
}

#[test]
fn a_query_that_is_open_meanwhile_gets_all_its_rows() {
    let (goes, stays) =
        (campaign("goes", "[1.0]", "runs_per_point = 6"), campaign("stays", "[2.0]", "runs_per_point = 6"));
    let dir = scratch_of(&[&goes, &stays]);
    let expected = csv(dir.path(), "SELECT * FROM samples");
    let meanwhile = || drop(forget(dir.path(), "goes").unwrap());
    assert_eq!(super::compact::rows_with_something_between(dir.path(), meanwhile), expected);
    drop(Store::open(dir.path()).unwrap());
    assert_eq!(check(dir.path()).unwrap().findings, []);
}
