//! What people, shells, `man` and editors read about the program: each is tried with what reads it.
#![allow(clippy::unwrap_used, clippy::print_stderr, reason = "helpers of tests are tests too")]

mod common;

use common::expect;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// What the program writes to stdout.
fn said(arguments: &[&str]) -> String {
    String::from_utf8(expect(0, root(), arguments).stdout).unwrap()
}

/// Runs another program; `None`, with a note, where it is not installed. MENISCUS_TEST_ALL=1 demands that it is.
fn other(program: &str, arguments: &[&str]) -> Option<Output> {
    let output = Command::new(program).args(arguments).env("NO_COLOR", "1").output();
    if output.is_err() {
        let demanded = std::env::var_os("MENISCUS_TEST_ALL").is_some_and(|value| value == "1");
        assert!(!demanded, "{program} is not installed");
        eprintln!("skipped: {program} is not installed");
    }
    output.ok()
}

/// The names of all subcommands, as `--help` lists them.
fn subcommands() -> Vec<String> {
    let help = said(&["--help"]);
    let (_, list) = help.split_once("Commands:\n").unwrap();
    let list = list.split("\n\n").next().unwrap();
    // What goes on in another line is set in further.
    let names = list.lines().filter(|line| line.starts_with("  ") && !line.starts_with("   "));
    let names: Vec<_> = names.filter_map(|line| line.split_whitespace().next()).map(str::to_owned).collect();
    assert!(names.len() >= 14, "{names:?}");
    names
}

#[test]
fn the_page_of_all_keys_is_what_the_program_writes() {
    let page = fs::read_to_string(root().join("docs/keys.md")).unwrap();
    assert!(page == said(&["keys", "--markdown"]), "write it anew: meniscus keys --markdown > docs/keys.md");
}

#[test]
fn every_key_and_every_table_is_listed_and_told_in_full() {
    let all = said(&["keys"]);
    for parameter in meniscus::parameters::PARAMETERS {
        assert!(all.contains(&format!("\n  {} ", parameter.name)), "{}", parameter.name);
        let one = said(&["keys", parameter.name]);
        for text in [parameter.about, parameter.unit, parameter.auto, &parameter.domain.allowed()] {
            assert!(one.contains(text), "{}: {one}", parameter.name);
        }
    }
    for name in ["name", "runs_per_point", "until", "max_runs", "tolerance", "limits", "grid", "block"] {
        assert!(said(&["keys", name]).starts_with(name), "{name}");
    }
    let unknown = String::from_utf8(expect(1, root(), &["keys", "gama"]).stderr).unwrap();
    assert!(unknown.contains("did you mean `gamma`?"), "{unknown}");
}

#[test]
fn the_help_of_query_names_every_view_that_a_store_has() {
    let folder = tempfile::tempdir().unwrap();
    drop(meniscus::store::Store::open(folder.path()).unwrap());
    let sql = "select name from sqlite_master where type = 'view' and name <> 'all_runs'";
    let views = said(&["query", folder.path().to_str().unwrap(), sql, "--format", "csv"]);
    let help = said(&["query", "--help"]);
    for view in views.lines().skip(1).chain(["samples"]) {
        assert!(help.contains(&format!("\n  {view} ")), "{view}: {help}");
    }
    assert!(help.contains("meniscus query quickstart.meniscus \"select"), "{help}");
}

#[test]
fn help_fits_a_terminal_of_eighty_columns() {
    let names: Vec<String> = subcommands().into_iter().filter(|name| name != "help").collect();
    let program = env!("CARGO_BIN_EXE_meniscus");
    let each = format!("stty rows 24 cols 80; for one in '' {}; do '{program}' $one --help; done", names.join(" "));
    let arguments = ["-qec", &each, "/dev/null"];
    let Some(output) = other("script", &arguments) else { return };
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("Usage: meniscus query") && text.contains("Usage: meniscus man"), "{text}");
    for line in text.lines().filter(|line| !line.contains("meniscus query") && !line.contains("meniscus completions")) {
        assert!(line.trim_end().chars().count() <= 80, "{line}");
    }
}

#[test]
fn bash_completes_subcommands_options_and_shells() {
    let folder = tempfile::tempdir().unwrap();
    let script = folder.path().join("meniscus.bash");
    fs::write(&script, said(&["completions", "bash"])).unwrap();
    let complete = |words: &[&str]| {
        let bash = "source \"$0\"; complete -p meniscus >/dev/null || exit 9
            COMP_WORDS=(meniscus \"$@\"); COMP_CWORD=$#; COMPREPLY=()
            _meniscus meniscus \"${COMP_WORDS[COMP_CWORD]}\" \"${COMP_WORDS[COMP_CWORD-1]}\"
            echo \"${COMPREPLY[@]}\"";
        let output = other("bash", &[&["-c", bash, script.to_str().unwrap()], words].concat())?;
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        Some(String::from_utf8(output.stdout).unwrap().trim().to_owned())
    };
    let Some(first) = complete(&[""]) else { return };
    for name in subcommands() {
        assert!(first.split(' ').any(|word| word == name), "{name}: {first}");
    }
    assert_eq!(complete(&["acc"]).unwrap(), "accuracy");
    assert_eq!(complete(&["run", "--dead"]).unwrap(), "--deadline");
    assert_eq!(complete(&["completions", "z"]).unwrap(), "zsh");
}

#[test]
fn zsh_completes_subcommands_and_options() {
    if other("zsh", &["--version"]).is_none() || other("script", &["--version"]).is_none() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("_meniscus"), said(&["completions", "zsh"])).unwrap();
    let zshrc = "fpath=($ZDOTDIR $fpath); autoload -Uz compinit; compinit -u -D\n\
                 meniscus() { print -r -- \"got:$*:\" }\n";
    fs::write(folder.path().join(".zshrc"), zshrc).unwrap();
    // What a person types, the Tab key included, into a shell of its own terminal.
    let typed = r"(printf 'meniscus acc\t\nmeniscus run --dead\t\nexit\n'; sleep 2)";
    let shell =
        format!("{typed} | ZDOTDIR='{}' TERM=dumb timeout 20 script -qec 'zsh -i' /dev/null", folder.path().display());
    let Some(output) = other("sh", &["-c", &shell]) else { return };
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("got:accuracy:") && text.contains("got:run --deadline:"), "{text}");
}

#[test]
fn man_shows_the_main_page_and_one_of_each_subcommand() {
    let folder = tempfile::tempdir().unwrap();
    let pages = folder.path().join("man 1");
    said(&["man", pages.to_str().unwrap()]);
    let main = folder.path().join("main.1");
    fs::write(&main, said(&["man"])).unwrap();
    let show = |page: &Path| {
        let output = other("man", &["-P", "cat", "-l", page.to_str().unwrap()])?;
        let text = String::from_utf8_lossy(&output.stdout).into_owned();
        let minimal = text.contains("has been minimized");
        assert!(output.status.success() || minimal, "{}", String::from_utf8_lossy(&output.stderr));
        (!minimal).then_some(text)
    };
    for name in subcommands().iter().filter(|name| *name != "help") {
        assert!(
            fs::read_to_string(pages.join(format!("meniscus-{name}.1"))).unwrap().contains(".SH SYNOPSIS"),
            "{name}"
        );
    }
    let (Some(main), Some(run)) = (show(&main), show(&pages.join("meniscus-run.1"))) else {
        eprintln!("skipped: this system has no man that shows pages");
        return;
    };
    assert!(main.contains("SYNOPSIS") && main.contains("meniscus-query(1)"), "{main}");
    assert!(run.contains("deadline") && run.contains("CAMPAIGN"), "{run}");
}

/// Bad campaigns that break what the schema cannot know: conditions on several keys or numbers, what blocks inherit,
/// and numbers that JSON does not have.
const BEYOND_A_SCHEMA: [&str; 24] = [
    "adaptive_for_sp",
    "bond_and_gamma",
    "darcy_looks",
    "darcy_springs",
    "darcy_vertices",
    "dt_too_large",
    "dt_too_large_at_one_point",
    "fixed_and_axis",
    "hydrostatic_ring",
    "idle_top_key",
    "implicit_for_sp",
    "inherited_range",
    "literal_wall_with_a_step",
    "no_room_at_the_start",
    "not_finite",
    "obstacles_too_many",
    "obstacles_wider_than_box",
    "springs_by_default",
    "step_error_of_fixed_steps",
    "tolerance_and_what_it_chooses",
    "tolerance_on_a_plate",
    "too_dense",
    "too_many_jobs",
    "until_in_a_channel",
];

/// Validates TOML files against the schema on its stdin, and prints the names of those that are refused.
const VALIDATE: &str = r#"
import json, sys, pathlib
try:
    import jsonschema, tomllib
except ImportError:
    sys.exit(7)
schema = json.load(sys.stdin)
jsonschema.Draft202012Validator.check_schema(schema)
validator = jsonschema.Draft202012Validator(schema)
for name in sys.argv[1:]:
    try:
        errors = list(validator.iter_errors(tomllib.loads(pathlib.Path(name).read_text())))
    except tomllib.TOMLDecodeError:
        errors = ["no TOML"]
    if errors:
        print(name)
        print(name, [getattr(error, "message", error) for error in errors][:3], file=sys.stderr)
"#;

/// The files that a validator refuses; `None` where there is no validator.
fn refused(files: &[PathBuf]) -> Option<Vec<PathBuf>> {
    let folder = tempfile::tempdir().unwrap();
    let schema = folder.path().join("campaign.schema.json");
    fs::write(&schema, said(&["schema"])).unwrap();
    let mut python = Command::new("python3");
    python.arg("-c").arg(VALIDATE).args(files).stdin(fs::File::open(&schema).unwrap());
    let output = python.output().ok().filter(|output| output.status.code() != Some(7));
    let Some(output) = output else {
        let demanded = std::env::var_os("MENISCUS_TEST_ALL").is_some_and(|value| value == "1");
        assert!(!demanded, "python3 with jsonschema is not installed");
        eprintln!("skipped: python3 with jsonschema is not installed");
        return None;
    };
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    eprintln!("{}", String::from_utf8_lossy(&output.stderr));
    Some(String::from_utf8(output.stdout).unwrap().lines().map(PathBuf::from).collect())
}

fn files(folder: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(root().join(folder)).unwrap().map(|entry| entry.unwrap().path());
    let mut files: Vec<_> = entries.filter(|file| file.extension().is_some_and(|kind| kind == "toml")).collect();
    files.sort();
    files
}

#[test]
fn a_validator_accepts_every_good_campaign_by_the_schema() {
    let good = [files("campaigns"), files("tests/campaign_files/good")].concat();
    let Some(refused) = refused(&good) else { return };
    assert!(good.len() > 20 && refused.is_empty(), "{refused:?}");
}

#[test]
fn a_validator_refuses_every_bad_campaign_that_a_schema_can_know() {
    let bad = files("tests/campaign_files/bad");
    let Some(refused) = refused(&bad) else { return };
    let accepted = bad.iter().filter(|file| !refused.contains(file));
    let accepted: Vec<_> = accepted.map(|file| file.file_stem().unwrap().to_str().unwrap()).collect();
    assert_eq!(accepted, BEYOND_A_SCHEMA);
}

#[test]
fn a_campaign_may_begin_with_the_line_that_names_its_schema() {
    let text = fs::read_to_string(root().join("campaigns/quickstart.toml")).unwrap();
    let text = format!("#:schema ./campaign.schema.json\n{text}");
    assert!(meniscus::campaign::file::Campaign::parse("quickstart.toml", &text).is_ok());
}
