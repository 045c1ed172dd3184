//! Stores, dumps and campaign files that a stranger made: nothing outside of the store is touched, nothing planted in
//! it runs, no command aborts, hangs, or takes the memory.
//!
//! Each test has what was once tried with success, and a relative of its kind. `hostile/fuzz.rs` makes many more.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "helpers of tests are tests too")]

mod common;
#[path = "hostile/dump.rs"]
mod dump;
#[path = "hostile/fuzz.rs"]
mod fuzz;
#[path = "fuzz/mutate.rs"]
#[allow(dead_code, reason = "campaign files are mutated elsewhere")]
mod mutate;
#[path = "hostile/parquet_files.rs"]
mod parquet_files;
#[path = "hostile/sandbox.rs"]
mod sandbox;
#[path = "hostile/worker.rs"]
mod worker;

use dump::Dump;
use parquet_files::{Odd, odd_file};
use sandbox::{CAMPAIGN, Sandbox, link, pipe, text};
use std::path::Path;
use std::time::{Duration, Instant};

/// The names of catalogued files that lead out of the store, or to no file at all.
#[test]
fn no_name_in_the_catalogue_leads_out_of_the_store() {
    for name in [
        "../victim/authorized_keys",
        "ABSOLUTE",
        "../victim",
        "samples/../../victim/notes.parquet",
        "/dev/zero",
        "lock",
        "",
    ] {
        let sandbox = Sandbox::new();
        let name = if name == "ABSOLUTE" { sandbox.victim("bashrc").display().to_string() } else { name.to_owned() };
        let path = sandbox.path().join(&name);
        let bytes = if path.is_file() { std::fs::read(path).unwrap() } else { Vec::new() };
        let checksum = blake3::hash(&bytes).to_hex();
        sandbox.sql(&format!("UPDATE sample_files SET path = '{name}', checksum = '{checksum}' WHERE key = 1"));
        let said = text(&sandbox.run(&["check", "store"]));
        assert!(said.contains("is not the name of a sample file"), "{name}: {said}");
        let said = text(&sandbox.run(&["query", "store", "select count(t) from samples"]));
        assert!(said.contains("check"), "{name}: {said}");
        sandbox.run_all();
    }
}

#[test]
fn a_repair_takes_foreign_names_out_and_the_jobs_are_computed_again() {
    let sandbox = Sandbox::new();
    let whole =
        text(&sandbox.run(&["query", "store", "select job_id, t, r from samples order by 1, 2", "--format", "csv"]));
    sandbox.sql("UPDATE sample_files SET path = '../victim/notes.parquet'");
    sandbox.run(&["check", "store", "--repair"]);
    assert!(text(&sandbox.run(&["-q", "run", "letter.toml", "--store", "store"])).contains("gamma"));
    assert_eq!(text(&sandbox.run(&["check", "store"])).matches("nothing is wrong").count(), 1);
    let again =
        text(&sandbox.run(&["query", "store", "select job_id, t, r from samples order by 1, 2", "--format", "csv"]));
    assert_eq!(again, whole);
}

#[test]
fn links_in_the_place_of_files_and_folders_are_not_followed() {
    for (name, target) in [
        ("lock", "bashrc"),
        ("readers", "bashrc"),
        ("store.db", "bashrc"),
        ("store.db-wal", "bashrc"),
        ("store.db-journal", "bashrc"),
        ("store.db.seal", "bashrc"),
        ("store.db.seal.tmp", "bashrc"),
        ("store.db.schema-1", "bashrc"),
        ("samples", "folder"),
        ("samples", ""),
        ("aside", ""),
        ("checkpoints", ""),
        ("dumps", ""),
        ("quarantine", "folder"),
        ("forgetting", "folder"),
        ("rescue.tmp", "folder"),
    ] {
        let sandbox = Sandbox::new();
        let commands = sandbox.commands();
        link(&sandbox.victim(target), &sandbox.store().join(name));
        for command in commands.iter().filter(|command| command[0] != "replay") {
            let words: Vec<&str> = command.iter().map(String::as_str).collect();
            let said = text(&sandbox.run(&words));
            assert!(said.contains("is a symbolic link"), "{name}, {words:?}: {said}");
            assert!(said.contains(name), "{name}, {words:?}: {said}");
        }
    }
}

#[test]
fn links_within_the_folders_of_a_store_are_left_alone() {
    for (name, target) in [
        ("aside/batch.tmp", "bashrc"),
        ("samples/0123456789abcdef0123.parquet", "notes.parquet"),
        ("aside/0123456789abcdef0123.parquet", "notes.parquet"),
        ("checkpoints/0123456789abcdef0123.ckpt.tmp", "bashrc"),
        ("dumps/0123456789abcdef0123.ckpt", "bashrc"),
        ("checkpoints/JOB.ckpt", "bashrc"),
        ("dumps/JOB.ckpt", "bashrc"),
    ] {
        let sandbox = Sandbox::new();
        let name = name.replace("JOB", &sandbox.a_job());
        sandbox.sql("UPDATE jobs SET state = 'pending'; DELETE FROM outcomes; DELETE FROM sample_index; DELETE FROM clogs; DELETE FROM shape_rows");
        link(&sandbox.victim(target), &sandbox.store().join(name));
        sandbox.run_all();
    }
    // A catalogued file that is a link to one with the right bytes.
    let sandbox = Sandbox::new();
    let file = std::fs::read_dir(sandbox.store().join("samples")).unwrap().next().unwrap().unwrap().path();
    let copy = sandbox.path().join("copy.parquet");
    std::fs::rename(&file, &copy).unwrap();
    link(&copy, &file);
    let said = text(&sandbox.run(&["query", "store", "select count(t) from samples"]));
    assert!(said.contains("symbolic link"), "{said}");
    sandbox.run_all();
    assert!(copy.symlink_metadata().unwrap().is_file());
}

#[test]
fn a_second_name_of_the_lock_keeps_its_text() {
    let sandbox = Sandbox::new();
    std::fs::remove_file(sandbox.store().join("lock")).unwrap();
    std::fs::hard_link(sandbox.victim("bashrc"), sandbox.store().join("lock")).unwrap();
    sandbox.run_all();
}

/// SQLite removes the file that the end of a journal names, once it has rolled the journal back.
#[test]
fn a_journal_that_names_another_file_is_refused() {
    let sandbox = Sandbox::new();
    sandbox.sql("PRAGMA journal_mode = delete; PRAGMA journal_mode = persist; UPDATE jobs SET attempts = 2");
    let name = sandbox.victim("bashrc").display().to_string();
    let journal = sandbox.store().join("store.db-journal");
    // The head of a journal of one page that is as the database has it, and the pointer.
    let database = std::fs::read(sandbox.store().join("store.db")).unwrap();
    let mut bytes = vec![0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7];
    bytes.extend([1_u32, 0, (database.len() / 4096) as u32, 512, 4096].iter().flat_map(|number| number.to_be_bytes()));
    bytes.resize(512, 0);
    let sum = (1..=20).map(|k| 4096 - 200 * k).fold(0_u32, |sum, at| sum.wrapping_add(u32::from(database[at])));
    bytes.extend(1_u32.to_be_bytes());
    bytes.extend(&database[..4096]);
    bytes.extend(sum.to_be_bytes());
    let page = (0x4000_0000_u32 / 4096 + 1).to_be_bytes();
    let check: u32 = name.bytes().map(u32::from).sum();
    bytes.extend(page.iter().chain(name.as_bytes()));
    bytes.extend((name.len() as u32).to_be_bytes().iter().chain(&check.to_be_bytes()));
    bytes.extend([0xd9, 0xd5, 0x05, 0xf9, 0x20, 0xa1, 0x63, 0xd7]);
    std::fs::write(&journal, bytes).unwrap();
    let said = text(&sandbox.run(&["status", "store"]));
    assert!(said.contains("names another file"), "{said}");
    sandbox.run_all();
}

#[test]
fn pipes_devices_and_folders_in_the_place_of_files_are_refused_and_not_waited_for() {
    for name in ["lock", "readers", "store.db", "store.db-wal", "store.db.seal", "samples"] {
        let sandbox = Sandbox::new();
        let commands = sandbox.commands();
        let _ = std::fs::remove_dir_all(sandbox.store().join(name));
        pipe(&sandbox.store().join(name));
        for command in commands.iter().filter(|command| command[0] != "replay") {
            let words: Vec<&str> = command.iter().map(String::as_str).collect();
            let said = text(&sandbox.run(&words));
            assert!(said.contains("is a named pipe") && said.contains(name), "{words:?}: {said}");
        }
    }
    for make in [pipe, |path: &Path| std::fs::remove_file(path).and_then(|()| std::fs::create_dir(path)).unwrap()] {
        let sandbox = Sandbox::new();
        let file = std::fs::read_dir(sandbox.store().join("samples")).unwrap().next().unwrap().unwrap().path();
        make(&file);
        let said = text(&sandbox.run(&["check", "store"]));
        assert!(said.contains("it is a named pipe") || said.contains("it is a folder"), "{said}");
        for name in ["samples/00000000000000000000.parquet", "dumps/x.ckpt", "checkpoints/0123456789abcdef0123.ckpt"] {
            pipe(&sandbox.store().join(name));
        }
        sandbox.run_all();
    }
}

#[test]
fn sample_files_of_other_columns_or_with_lies_in_them_are_found_and_put_aside() {
    for odd in Odd::ALL {
        let sandbox = Sandbox::new();
        let file = std::fs::read_dir(sandbox.store().join("samples")).unwrap().next().unwrap().unwrap().path();
        let bytes = odd_file(odd, &std::fs::read(&file).unwrap());
        std::fs::write(&file, &bytes).unwrap();
        let name = file.file_name().unwrap().to_str().unwrap();
        sandbox.sql(&format!(
            "UPDATE sample_files SET checksum = '{}', bytes = {} WHERE path = 'samples/{name}'",
            blake3::hash(&bytes).to_hex(),
            bytes.len()
        ));
        let said = text(&sandbox.run(&["query", "store", "select job_id, t, shape from samples"]));
        assert!(said.contains("check"), "{odd:?}: {said}");
        let said = text(&sandbox.run(&["check", "store"]));
        assert!(said.contains(name), "{odd:?}: {said}");
        sandbox.run_all();
    }
}

#[test]
fn a_dump_of_a_job_that_no_campaign_can_ask_for_is_refused() {
    let dump = Dump::new();
    for (change, blamed) in [
        (("\"box_size\":20.0", "\"box_size\":20000.0"), "box_size"),
        (("\"n_vertices\":32", "\"n_vertices\":1000000000"), "n_vertices"),
        (("\"dt\":0.0625", "\"dt\":0.0"), "dt"),
        (("\"dt\":0.0625", "\"dt\":1e-300"), "dt"),
        (("\"sample_every\":2.0", "\"sample_every\":1e-9"), "sample_every"),
        (("\"t_max\":60.0", "\"t_max\":-1.0"), "t_max"),
        (("\"density\":{\"number\":0.7}", "\"density\":{\"number\":1e300}"), "density"),
    ] {
        let said = dump.replayed_with(change.0, change.1);
        assert!(said.contains("no campaign can ask for") && said.contains(blamed), "{change:?}: {said}");
    }
    assert!(dump.replayed_with("", "").contains("ended otherwise"));
}

#[test]
fn a_point_in_a_store_that_no_campaign_can_ask_for_is_not_drawn() {
    for change in [("\"box_size\":20.0", "\"box_size\":20000.0"), ("\"w_ob\":0.2", "\"w_ob\":-0.29999")] {
        let sandbox = Sandbox::new();
        sandbox.sql(&format!("UPDATE points SET spec = replace(spec, '{}', '{}')", change.0, change.1));
        let said = text(&sandbox.run(&["render", "store", &sandbox.a_job(), "-o", "out/x.png"]));
        assert!(said.contains("cannot be drawn"), "{change:?}: {said}");
        let said = text(&sandbox.run(&["query", "store", "select count(*) from obstacles"]));
        assert!(said.contains("check"), "{change:?}: {said}");
        sandbox.run_all();
    }
}

#[test]
fn shapes_and_paths_that_no_droplet_has_are_not_drawn() {
    for numbers in ["1.7e308", "-1e300", "1e12", "inf"] {
        let sandbox = Sandbox::new();
        let number: f64 = numbers.parse().unwrap();
        let bytes: String = [number, 0.0, 1.0, 2.0]
            .iter()
            .flat_map(|x: &f64| x.to_le_bytes())
            .map(|byte| format!("{byte:02x}"))
            .collect();
        sandbox.sql(&format!("UPDATE shape_rows SET vertices = x'{bytes}'"));
        let said = text(&sandbox.run(&["render", "store", &sandbox.a_job(), "-o", "out/x.png"]));
        assert!(said.contains("outline cannot be read"), "{numbers}: {said}");
        sandbox.run_all();
    }
}

#[test]
fn campaigns_that_would_eat_memory_or_never_end_are_refused_before_anything_runs() {
    let sandbox = Sandbox::new();
    for (change, blamed) in [
        (("sample_every = 2.0", "sample_every = 1e-9"), "sample_every"),
        (("sample_every = 2.0", "shapes_every = 1.0"), "shapes_every"),
        (("box_size = 20.0", "box_size = 5000.0"), "box_size"),
        (("box_size = 20.0", "dt = 1e-300"), "dt"),
        (("box_size = 20.0", "dt = 1e-13"), "dt"),
    ] {
        let mut text_of_file = CAMPAIGN.replace(change.0, change.1).replace("n_vertices = 32", "n_vertices = 4096");
        if blamed == "box_size" {
            text_of_file = text_of_file.replace("density = 0.7", "density = 2.0");
        }
        if blamed.ends_with("_every") {
            text_of_file = text_of_file.replace("t_max = 60.0", "t_max = 2e5");
        }
        std::fs::write(sandbox.path().join("eats.toml"), text_of_file).unwrap();
        for command in ["plan", "run"] {
            let output = sandbox.run(&[command, "eats.toml", "--store", "eaten"]);
            let said = text(&output);
            assert!(output.status.code() == Some(1) && said.contains(&format!("{blamed}: ")), "{change:?}: {said}");
        }
        assert!(!sandbox.path().join("eaten").exists());
    }
    let said = text(&sandbox.run(&["plan", "letter.toml", "--store", "store"]));
    assert!(said.contains("memory"), "{said}");
}

#[test]
fn a_run_that_is_placing_obstacles_heeds_a_signal() {
    let sandbox = Sandbox::new();
    let large = CAMPAIGN.replace("box_size = 20.0", "box_size = 3000.0");
    std::fs::write(sandbox.path().join("large.toml"), large).unwrap();
    let mut child = common::meniscus(sandbox.path(), &["-q", "run", "large.toml", "--store", "large"]).spawn().unwrap();
    std::thread::sleep(Duration::from_millis(1500));
    let begin = Instant::now();
    std::process::Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert!(begin.elapsed() < Duration::from_secs(20), "it took {:?}", begin.elapsed());
}

#[test]
fn what_is_planted_in_a_schema_does_not_run_and_a_repair_leaves_it_out() {
    let endless = "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT count(*) AS job_id FROM n";
    for planted in [
        "CREATE TRIGGER t AFTER UPDATE ON jobs BEGIN UPDATE outcomes SET r_end = 99; END".to_owned(),
        format!("CREATE TRIGGER t AFTER UPDATE ON jobs BEGIN INSERT INTO current SELECT 2, ({endless}); END"),
        format!("DROP VIEW runs; CREATE VIEW runs AS {endless}"),
        format!("CREATE VIEW samples AS {endless}"),
        "CREATE TABLE outline (job_id, t, vertex, x, y)".to_owned(),
        "CREATE INDEX i ON outcomes (length(hex(zeroblob(1000000))))".to_owned(),
        "CREATE VIRTUAL TABLE v USING fts5(x)".to_owned(),
        "ALTER TABLE campaigns ADD COLUMN g AS (length(hex(zeroblob(1000000))))".to_owned(),
    ] {
        let sandbox = Sandbox::new();
        let schema = format!("schema {}", sandbox.schema());
        sandbox.sql(&planted);
        let commands = sandbox.commands();
        for command in commands.iter().filter(|command| !["check", "replay"].contains(&command[0].as_str())) {
            let words: Vec<&str> = command.iter().map(String::as_str).collect();
            let said = text(&sandbox.run(&words));
            assert!(said.contains(&schema) && said.contains("check"), "{planted}, {words:?}: {said}");
        }
        let said = text(&sandbox.run(&["check", "store"]));
        assert!(said.contains(&schema), "{planted}: {said}");
        sandbox.run(&["check", "store", "--repair"]);
        let said = text(&sandbox.run(&["check", "store"]));
        assert!(said.contains("nothing is wrong with 6 jobs"), "{planted}: {said}");
        let ends = text(&sandbox.run(&["query", "store", "select max(r_end) < 10 from runs", "--format", "csv"]));
        assert!(ends.contains("\n1\n"), "{planted}: {ends}");
        sandbox.run_all();
    }
}

#[test]
fn nothing_that_a_terminal_obeys_is_printed() {
    let sandbox = Sandbox::new();
    let evil = "\u{1b}]52;c;ZXZpbA==\u{7}\u{9b}2J\u{202e}\nstore: nothing is wrong with 6 jobs and 1 sample files";
    let quoted = evil.replace('\'', "''");
    sandbox.sql(&format!(
        "UPDATE campaigns SET name = '{quoted}';
         UPDATE jobs SET state = 'failed' WHERE key = 1;
         UPDATE outcomes SET outcome = NULL, error_class = 'unstable', error = '{quoted}' WHERE job = 1;
         UPDATE sample_files SET path = '{quoted}';
         UPDATE shape_rows SET loads = '{quoted}'"
    ));
    std::fs::write(sandbox.store().join("lock"), format!("1 {evil}\n")).unwrap();
    std::fs::write(sandbox.store().join("samples").join(format!("{}.parquet", evil.replace('/', "_"))), "x").unwrap();
    let dump = Dump::new().failed_with(evil);
    std::fs::copy(dump.path(), sandbox.path().join("dump.ckpt")).unwrap();
    let mut commands = sandbox.commands();
    commands.push(["replay", "dump.ckpt"].map(str::to_owned).to_vec());
    commands.push(
        ["query", "store", "select error from failures union select name from campaigns"].map(str::to_owned).to_vec(),
    );
    commands.push(vec!["plan".to_owned(), format!("{}.toml", evil.replace('/', "_"))]);
    // JSON and CSV that do not go to a terminal are for programs, which get every character.
    for command in commands.iter().filter(|command| !command.iter().any(|word| word == "--json" || word == "csv")) {
        let words: Vec<&str> = command.iter().map(String::as_str).collect();
        let said = text(&sandbox.run(&words));
        let obeyed = said.chars().find(|c| c.is_control() && *c != '\n' && *c != '\t' || *c == '\u{202e}');
        assert_eq!(obeyed, None, "{words:?}: {said:?}");
        assert!(!said.lines().any(|line| line.starts_with("store: nothing is wrong with 6")), "{words:?}: {said}");
    }
}

#[test]
fn a_name_that_sqlite_takes_for_a_uri_is_a_folder() {
    let sandbox = Sandbox::new();
    for name in ["file:q?mode=memory&", "file:x", "file::memory:"] {
        sandbox.run(&["-q", "run", "letter.toml", "--store", name]);
        assert!(sandbox.path().join(name).join("store.db").metadata().unwrap().len() > 0);
        let said = text(&sandbox.run(&["status", name]));
        assert!(said.contains("6 done"), "{name}: {said}");
    }
}

#[test]
fn inputs_have_a_largest_size_and_problems_a_number() {
    let sandbox = Sandbox::new();
    for file in ["/dev/zero", "/dev/urandom"] {
        for command in
            [&["plan", file][..], &["query", "store", "-f", file], &["calibrate", file, "--w", "0.7", "--v-t", "0.03"]]
        {
            let output = sandbox.run(command);
            assert_eq!(output.status.code(), Some(1), "{command:?}: {}", text(&output));
        }
    }
    let keys: String = (0..20_000).map(|k| format!("key_{k} = 1\n")).collect();
    let values = format!("{CAMPAIGN}\n[grid]\nv_t = [{}]\n", "0.03, ".repeat(20_000));
    let columns = format!("h,{}\n{}", vec!["v_g"; 20_000].join(","), vec!["1"; 20_001].join(","));
    for (name, body) in [("keys.toml", keys), ("values.toml", values), ("columns.csv", columns)] {
        std::fs::write(sandbox.path().join(name), body).unwrap();
        let begin = Instant::now();
        let words = if name.ends_with("csv") {
            vec!["calibrate", name, "--w", "0.7", "--v-t", "0.03"]
        } else {
            vec!["plan", name]
        };
        let output = sandbox.run(&words);
        assert_eq!(output.status.code(), Some(1), "{name}: {}", text(&output));
        assert!(text(&output).lines().count() < 400, "{name}");
        println!("{name}: {:?}", begin.elapsed());
    }
}

#[test]
fn a_reader_that_has_gone_is_no_reason_to_panic() {
    let sandbox = Sandbox::new();
    let program = common::meniscus(sandbox.path(), &[]).get_program().to_owned();
    sandbox.sql("UPDATE sample_files SET path = 'x'");
    for words in ["check store", "status store", "query store 'select * from runs'", "keys", "plan letter.toml"] {
        let script = format!("{} {words} 2>&1 | true; echo ${{PIPESTATUS[0]}}", program.display());
        let output =
            std::process::Command::new("bash").args(["-c", &script]).current_dir(sandbox.path()).output().unwrap();
        let code = text(&output);
        assert!(["0", "1"].contains(&code.trim()), "{words}: {code}");
    }
}

#[test]
fn cells_that_a_spreadsheet_would_run_are_texts_and_numbers_stay_numbers() {
    let sandbox = Sandbox::new();
    let sql = "select '=1+1' as a, '@x' as b, '+x' as c, '-x' as d, -1.5 as e, '-1.5' as f, '=a,\"b\"' as g";
    let said = text(&sandbox.run(&["query", "store", sql, "--format", "csv"]));
    assert_eq!(said, "a,b,c,d,e,f,g\n'=1+1,'@x,'+x,'-x,-1.5,-1.5,\"'=a,\"\"b\"\"\"\n");
}
