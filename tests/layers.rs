//! The layers hold: every folder of `src/` imports only from those before it, and no two neighbours import each other
//! in a circle.
//!
//! The test reads the `use` lines and the paths of the sources as text. Documentation, comments, strings and inline
//! test modules do not count: a test may look at anything.
#![allow(clippy::unwrap_used, reason = "helpers of tests")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// The layers, in the order in which they may import: each imports only from those before it.
const LAYERS: [&str; 9] =
    ["parameters", "results", "physics", "campaign", "study", "store", "execute", "report", "cli"];

/// The parts of the physics, likewise.
const PHYSICS: [&str; 8] = ["simd", "walls", "observation", "ring", "liquid", "point", "motion", "simulate"];

/// One path in the sources that leads from a module to another.
#[derive(Clone, Debug)]
struct Import {
    from: Vec<String>,
    to: Vec<String>,
    file: PathBuf,
    line: usize,
}

impl std::fmt::Display for Import {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}:{}: {} imports {}", self.file.display(), self.line, self.from.join("::"), self.to.join("::"))
    }
}

/// All source files below `dir`, sorted.
fn sources(dir: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(dir).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// The module that a file holds: `src/physics/ring/mod.rs` is `physics::ring`.
fn module(file: &Path, root: &Path) -> Vec<String> {
    let relative = file.strip_prefix(root).unwrap().with_extension("");
    let names = relative.iter().map(|name| name.to_string_lossy().into_owned());
    names.filter(|name| !["mod", "lib", "main"].contains(&name.as_str())).collect()
}

/// The text with comments blanked, and cut before its inline tests; lines keep their numbers.
fn code(text: &str) -> String {
    let body = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    let line = |line: &str| line.find("//").map_or_else(|| line.to_owned(), |comment| line[..comment].to_owned());
    body.lines().map(line).collect::<Vec<_>>().join("\n")
}

/// The paths that a tree of imports stands for: `a::{b, c::d}` is `a::b` and `a::c::d`.
fn paths(tree: &str) -> Vec<String> {
    let Some((stem, rest)) = tree.split_once('{') else { return vec![tree.trim().to_owned()] };
    let (mut depth, mut branch, mut branches) = (0, String::new(), Vec::new());
    for c in rest.chars() {
        match c {
            '}' if depth == 0 => break,
            ',' if depth == 0 => branches.push(std::mem::take(&mut branch)),
            _ => {
                depth += i32::from(c == '{') - i32::from(c == '}');
                branch.push(c);
            }
        }
    }
    branches.push(branch);
    branches.iter().flat_map(|branch| paths(branch)).map(|path| format!("{}{path}", stem.trim())).collect()
}

/// The tree of imports at the beginning of `text`, up to the end of its braces or of its last name.
fn tree(text: &str) -> &str {
    let mut depth = 0;
    for (i, c) in text.char_indices() {
        depth += i32::from(c == '{') - i32::from(c == '}');
        let inside = c.is_alphanumeric() || "_:{}".contains(c) || (depth > 0 && (c.is_whitespace() || c == ','));
        if !inside || (depth == 0 && c == '}') {
            return &text[..i + usize::from(c == '}' && depth == 0)];
        }
        if depth < 0 {
            return &text[..i];
        }
    }
    text
}

/// The modules of test code among `files`: those that are declared behind `#[cfg(test)]`.
fn test_modules(files: &[PathBuf], root: &Path) -> BTreeSet<Vec<String>> {
    let mut found = BTreeSet::new();
    for file in files {
        let text = fs::read_to_string(file).unwrap();
        for declared in text.split("#[cfg(test)]\n").skip(1) {
            let declared = declared.lines().next().unwrap_or_default().trim();
            let name = declared.strip_suffix(';').and_then(|line| line.rsplit_once("mod "));
            found.extend(name.map(|(_, name)| [module(file, root), vec![name.to_owned()]].concat()));
        }
    }
    found
}

/// Every import of the crate's own modules in the files below `root`, test code left out.
fn imports(root: &Path) -> Vec<Import> {
    let mut files = sources(root);
    let tests = test_modules(&files, root);
    files.retain(|file| !tests.iter().any(|test| module(file, root).starts_with(test)));
    let modules: BTreeSet<Vec<String>> = files.iter().map(|file| module(file, root)).collect();
    let mut found = Vec::new();
    for file in &files {
        let (from, code) = (module(file, root), code(&fs::read_to_string(file).unwrap()));
        for (at, start) in code.match_indices("crate::") {
            // `$crate` stands in a macro, which is expanded elsewhere.
            if code[..at].ends_with('$') {
                continue;
            }
            let line = code[..at].matches('\n').count() + 1;
            for path in paths(tree(&code[at + start.len()..])) {
                let mut to: Vec<String> = path.split("::").map(|name| name.trim().to_owned()).collect();
                while !to.is_empty() && !modules.contains(&to) {
                    to.pop();
                }
                if !to.is_empty() && to != from {
                    found.push(Import { from: from.clone(), to, file: file.clone(), line });
                }
            }
        }
        assert!(!code.contains("super::"), "{}: `super::` outside a test; write the path from `crate`", file.display());
    }
    found
}

/// The imports between neighbours of one folder, by folder and pair.
fn between_neighbours(imports: &[Import]) -> BTreeMap<Vec<String>, BTreeMap<[String; 2], &Import>> {
    let mut folders: BTreeMap<Vec<String>, BTreeMap<[String; 2], &Import>> = BTreeMap::new();
    for import in imports {
        let shared = import.from.iter().zip(&import.to).take_while(|(a, b)| a == b).count();
        if let (Some(from), Some(to)) = (import.from.get(shared), import.to.get(shared)) {
            let folder = folders.entry(import.from[..shared].to_vec()).or_default();
            folder.entry([from.clone(), to.clone()]).or_insert(import);
        }
    }
    folders
}

/// An import that is part of a circle among the neighbours of a folder, if there is one.
fn in_a_circle<'a>(pairs: &BTreeMap<[String; 2], &'a Import>) -> Option<&'a Import> {
    pairs.iter().find(|([from, to], _)| reaches(pairs, to, from)).map(|(_, import)| *import)
}

/// Whether imports lead from one neighbour to another.
fn reaches(pairs: &BTreeMap<[String; 2], &Import>, from: &str, to: &str) -> bool {
    let (mut seen, mut waiting) = (BTreeSet::from([from.to_owned()]), vec![from.to_owned()]);
    while let Some(here) = waiting.pop() {
        if here == to {
            return true;
        }
        for [_, next] in pairs.keys().filter(|[start, _]| *start == here) {
            if seen.insert(next.clone()) {
                waiting.push(next.clone());
            }
        }
    }
    false
}

/// The imports that go against the order of the neighbours in a folder.
fn against(order: &[&str], pairs: &BTreeMap<[String; 2], &Import>) -> Vec<String> {
    let place = |name: &str| {
        let place = order.iter().position(|known| known == &name);
        place.unwrap_or_else(|| panic!("`{name}` has no place in the order {order:?} of this test"))
    };
    let wrong = pairs.iter().filter(|([from, to], _)| place(to) > place(from));
    wrong.map(|(_, import)| import.to_string()).collect()
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

#[test]
fn every_layer_imports_only_from_those_before_it() {
    let imports = imports(&root());
    let folders = between_neighbours(&imports);
    let physics = vec!["physics".to_owned()];
    let wrong = [against(&LAYERS, &folders[&Vec::new()]), against(&PHYSICS, &folders[&physics])].concat();
    assert!(wrong.is_empty(), "imports against the order of the layers:\n{}", wrong.join("\n"));
}

#[test]
fn no_two_neighbours_import_each_other_in_a_circle() {
    let imports = imports(&root());
    let circles = between_neighbours(&imports).into_values().filter_map(|pairs| in_a_circle(&pairs));
    let circles: Vec<String> = circles.map(Import::to_string).collect();
    assert!(circles.is_empty(), "imports that close a circle:\n{}", circles.join("\n"));
}

#[test]
fn the_order_in_lib_rs_is_that_of_this_test() {
    let text = fs::read_to_string(root().join("lib.rs")).unwrap();
    let listed: Vec<&str> = text.lines().filter_map(|line| line.strip_prefix("//! | [`")?.split('`').next()).collect();
    assert_eq!(listed, LAYERS);
}

#[test]
fn an_import_against_the_order_and_a_circle_are_found() {
    let dir = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| {
        let path = dir.path().join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    };
    write(
        "physics/mod.rs",
        "// A comment may name crate::store::Store.\nuse crate::{\n    parameters::Point,\n    store::{Store, error},\n};\n",
    );
    write("parameters.rs", "#[cfg(test)]\nmod tests {\n    use crate::store::Store;\n}\n");
    write("store/mod.rs", "pub fn of(_: &crate::physics::Motion) {}\n");
    let imports = imports(dir.path());
    let folders = between_neighbours(&imports);
    let pairs = &folders[&Vec::new()];
    assert_eq!(
        pairs.keys().map(|pair| pair.join(" ")).collect::<Vec<_>>(),
        ["physics parameters", "physics store", "store physics"]
    );
    let wrong = against(&LAYERS, pairs);
    assert_eq!(wrong.len(), 1);
    assert!(wrong[0].ends_with("physics/mod.rs:2: physics imports store"), "{wrong:?}");
    assert!(in_a_circle(pairs).is_some());
}
