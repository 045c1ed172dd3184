//! Campaign files, good and bad, each with the expected answer in its comments, and the laws they obey.

use meniscus::campaign::file::{Campaign, CampaignErrors};
use meniscus::parameters::JobId;
use proptest::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};

fn files(folder: &str) -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let entries = fs::read_dir(&folder).expect("the folder is part of the package");
    let mut files: Vec<_> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.retain(|file| file.extension().is_some_and(|extension| extension == "toml"));
    files.sort();
    files
}

fn expectations(text: &str) -> Vec<&str> {
    text.lines().filter_map(|line| line.strip_prefix("# expect: ")).collect()
}

#[test]
fn every_bad_file_is_refused_with_exactly_the_mistakes_its_comments_name() {
    let files = files("tests/campaign_files/bad");
    assert!(files.len() >= 20);
    let mut wrong = String::new();
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        let problems = match Campaign::load(&file) {
            Ok(_) => vec!["nothing at all".to_owned()],
            Err(errors) => errors.problems().iter().map(ToString::to_string).collect(),
        };
        if problems != expectations(&text) || problems.is_empty() {
            wrong += &format!("{}\n  {}\n", file.display(), problems.join("\n  "));
        }
    }
    assert!(wrong.is_empty(), "found instead:\n{wrong}");
}

#[test]
fn every_good_file_has_the_points_and_jobs_its_comments_name() {
    let files = files("tests/campaign_files/good");
    assert!(files.len() >= 5);
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        let campaign = Campaign::load(&file).unwrap_or_else(|errors| panic!("{}", errors.render(false)));
        let found: Vec<_> = campaign
            .blocks
            .iter()
            .map(|block| format!("{}: {} points, {} jobs", block.name, block.points.len(), block.n_jobs()))
            .collect();
        assert_eq!(found, expectations(&text), "{}", file.display());
    }
}

#[test]
fn a_bond_number_gives_the_points_of_its_line_tension() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/campaign_files/good/bond.toml");
    let blocks = Campaign::load(&file).unwrap_or_else(|errors| panic!("{}", errors.render(false))).blocks;
    assert_eq!(blocks[0].point_ids, blocks[1].point_ids);
}

#[test]
fn every_campaign_that_is_shipped_loads_and_says_what_it_is_about() {
    let files = files("campaigns");
    assert!(files.len() >= 6);
    for file in files {
        let campaign = Campaign::load(&file).unwrap_or_else(|errors| panic!("{}", errors.render(false)));
        assert_eq!(Some(campaign.name.as_str()), file.file_stem().and_then(|stem| stem.to_str()));
        assert!(campaign.about.len() > 40 && campaign.n_jobs() > 0, "{}", campaign.name);
    }
}

#[test]
fn a_missing_file_is_named() {
    let error = Campaign::load(Path::new("no/such.toml")).unwrap_err();
    assert!(matches!(error, CampaignErrors::Unreadable { .. }));
    assert!(error.to_string().contains("no/such.toml") && error.problems().is_empty());
}

#[test]
fn a_file_that_is_not_text_is_refused_with_the_line() {
    let file = tempfile::NamedTempFile::new().unwrap();
    fs::write(file.path(), b"name = \"x\"\nabout = \"\xff\"\n").unwrap();
    let error = Campaign::load(file.path()).unwrap_err();
    assert!(matches!(error, CampaignErrors::NotUtf8 { line: 2, .. }));
}

#[test]
fn colour_adds_escapes_and_nothing_else() {
    let error = Campaign::parse("sketch.toml", "gama = 1").unwrap_err();
    let plain = error.render(false);
    assert!(plain.contains("sketch.toml:1:1") && plain.contains("did you mean `gamma`?") && !plain.contains('\u{1b}'));
    let coloured = error.render(true);
    let mut stripped = String::new();
    let mut rest = coloured.as_str();
    while let Some((before, after)) = rest.split_once("\u{1b}[") {
        stripped += before;
        rest = after.split_once('m').unwrap().1;
    }
    assert!(coloured.contains('\u{1b}'));
    assert_eq!(stripped + rest, plain);
}

#[test]
fn the_job_that_the_readme_draws_is_one_of_the_quickstart() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let readme = fs::read_to_string(root.join("README.md")).unwrap();
    let (_, rest) = readme.split_once("meniscus render quickstart.meniscus ").unwrap();
    let drawn = rest.split('`').next().unwrap();
    let picture = fs::read_to_string(root.join("docs/clog.svg")).unwrap();
    assert!(picture.contains(drawn), "docs/clog.svg shows another job than {drawn}");
    let quickstart = Campaign::load(&root.join("campaigns/quickstart.toml")).unwrap();
    let jobs = quickstart.blocks.iter().flat_map(|block| block.point_ids.iter().zip(std::iter::repeat(&block.seeds)));
    let mut ids = jobs.flat_map(|(&point, seeds)| seeds.clone().map(move |seed| JobId::new(point, seed).to_string()));
    assert!(ids.any(|id| id == drawn), "no job of quickstart.toml is {drawn}; draw one anew");
}

proptest! {
    #[test]
    fn a_damaged_file_is_read_or_refused_with_places_inside_it(
        which in any::<prop::sample::Index>(),
        at in any::<prop::sample::Index>(),
        length in 0_usize..30,
        patch in prop::sample::select(vec!["", "=", "[", "]", "{", "}", "\"", "\n", "-", "é", "inf", "[[block]]", "0x", "\r\n", "#"]),
    ) {
        let files = files("tests/campaign_files/good");
        let text = fs::read_to_string(which.get(&files)).unwrap();
        let start = at.index(text.len());
        let end = (start + length).min(text.len());
        prop_assume!(text.is_char_boundary(start) && text.is_char_boundary(end));
        let damaged = format!("{}{patch}{}", &text[..start], &text[end..]);
        if let Err(errors) = Campaign::parse("damaged.toml", &damaged) {
            let lines = damaged.split('\n').count();
            prop_assert!(!errors.problems().is_empty());
            prop_assert!(errors.problems().iter().all(|p| (1..=lines).contains(&p.line) && p.column >= 1));
            prop_assert!(errors.render(false).contains("damaged.toml"));
        }
    }
}

/// A campaign whose axis has so many values, each on a line of its own or all on one.
fn with_axis(values: usize, separator: &str, value: impl Fn(usize) -> String) -> String {
    let values: Vec<String> = (0..values).map(value).collect();
    let head = "name = \"long\"\nmodel = \"SP\"\nscene = \"plate\"\nruns_per_point = 1\n";
    format!("{head}[grid]\ne_w = [{}]\nv_t = [0.0]\ng_w = [1.0]\n", values.join(separator))
}

#[test]
fn of_many_bad_values_on_an_axis_the_first_are_shown_and_the_others_counted() {
    for separator in [", ", ",\n"] {
        // So many that whoever reads the file again for each of them takes minutes.
        let text = with_axis(100_000, separator, |index| format!("-{index}.5"));
        let error = Campaign::parse("long.toml", &text).unwrap_err();
        assert_eq!(error.problems().len(), 100_002);
        let shown = error.render(false);
        assert!(shown.lines().count() < 100 && shown.len() < 10_000, "{shown}");
        assert!(shown.contains("99995 more mistakes are not shown: grid.e_w (99995)"), "{shown}");
        assert!(shown.contains("grid.v_t") && shown.contains("grid.g_w"), "other keys are not hidden: {shown}");
        let last = error.problems().iter().rfind(|problem| problem.key.as_deref() == Some("grid.e_w")).unwrap();
        let place = text.find("-99999.5").unwrap();
        let line = text[..place].matches('\n').count() + 1;
        let column = place - text[..place].rfind('\n').unwrap();
        assert_eq!((last.line, last.column), (line, column));
    }
}

#[test]
fn of_many_unknown_keys_and_of_many_repeated_values_some_are_shown_as_well() {
    let keys: String = (0..3000).map(|index| format!("zzz{index} = 1\n")).collect();
    let shown = Campaign::parse("keys.toml", &format!("name = \"keys\"\n{keys}")).unwrap_err().render(false);
    assert!(shown.lines().count() < 500, "{} lines", shown.lines().count());
    assert!(shown.contains("more mistakes are not shown: ") && shown.contains(" other keys"), "{shown}");
    let text = with_axis(3000, ", ", |index| format!("{}.5", index / 2));
    let shown = Campaign::parse("twice.toml", &text).unwrap_err().render(false);
    assert!(shown.contains("1495 more mistakes are not shown: grid.e_w (1495)"), "{shown}");
}

#[test]
fn a_campaign_that_cannot_be_read_says_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let said = |path: &Path| Campaign::load(path).unwrap_err().render(false);
    assert!(said(&folder.path().join("none.toml")).contains("name a file that is there"));
    assert!(said(folder.path()).contains("name a file in this folder"));
    fs::write(folder.path().join("store.db"), "").unwrap();
    assert!(said(folder.path()).contains("this is a store") && said(folder.path()).starts_with("error: "));
}

#[test]
fn digits_before_the_point_or_after_it_make_no_zero_but_a_written_zero_is_one() {
    let with = |b0: &str| {
        let text = format!("name = 'z'\nmodel = 'SP'\nscene = 'plate'\nruns_per_point = 1\ne_w = 1.0\nb0 = {b0}\n");
        Campaign::parse("z.toml", &text).map(|campaign| campaign.blocks[0].points[0].b0)
    };
    for zero in ["0", "0.0", "-0.0", "0e0", "0.000e-400", "0e-999"] {
        assert_eq!(with(zero).unwrap(), 0.0, "{zero}");
    }
    for lost in ["1e-400", "0.0001e-320", "4.9e-324", "10e-400"] {
        assert!(with(lost).is_err(), "{lost}");
    }
    assert_eq!(with("2.3e-308").unwrap(), 2.3e-308);
}
