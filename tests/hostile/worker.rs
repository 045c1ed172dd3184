//! A process that runs command after command with a gigabyte of memory, so that a process each need not be started.

use std::io::{BufRead, BufReader, ErrorKind, Write};
use std::os::fd::{AsFd, OwnedFd};
use std::os::unix::net::UnixStream;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::time::Duration;

/// Memory that the process may take, in KB of address space.
const MEMORY: u64 = 1_000_000;

/// Time that a command may take.
const PATIENCE: Duration = Duration::from_secs(30);

/// Tells the process that it is one.
const MARK: &str = "MENISCUS_TEST_WORKER";

/// What a command answers if it panicked.
const PANICKED: u8 = 255;

/// The process, as seen by who gives it commands.
pub struct Worker {
    child: Child,
    commands: UnixStream,
    answers: BufReader<UnixStream>,
    said: PathBuf,
}

impl Worker {
    /// Starts a process that writes all it says to the file `said`.
    pub fn start(said: &Path) -> Self {
        let (commands, theirs) = UnixStream::pair().unwrap();
        commands.set_read_timeout(Some(PATIENCE)).unwrap();
        let answers = BufReader::new(commands.try_clone().unwrap());
        // Appending, so that the next thing said comes at the beginning when the file is emptied.
        let out = std::fs::File::options().create(true).append(true).open(said).unwrap();
        let child = Command::new("bash")
            .args(["-c", &format!(r#"ulimit -v {MEMORY}; exec "$@""#), "bash"])
            .arg(std::env::current_exe().unwrap())
            .args(["--exact", "worker::serves", "--ignored", "--nocapture"])
            .envs([(MARK, "1"), ("RUST_BACKTRACE", "0"), ("MALLOC_ARENA_MAX", "4")])
            .stdin(OwnedFd::from(theirs))
            .stdout(out.try_clone().unwrap())
            .stderr(out)
            .spawn()
            .unwrap();
        Self { child, commands, answers, said: said.to_owned() }
    }

    /// Forgets what was said.
    pub fn hush(&self) {
        std::fs::File::create(&self.said).unwrap();
    }

    /// All that was said since.
    pub fn said(&self) -> String {
        String::from_utf8_lossy(&std::fs::read(&self.said).unwrap()).into_owned()
    }

    /// Runs the program with these arguments in a folder.
    ///
    /// # Errors
    /// If it does not end by itself, in time, with an exit code of its own.
    pub fn run(&mut self, folder: &Path, arguments: &[String]) -> Result<(), String> {
        let words: Vec<_> = std::iter::once(folder.display().to_string()).chain(arguments.iter().cloned()).collect();
        let line = serde_json::to_string(&words).unwrap() + "\n";
        let mut answer = String::new();
        let answered = self.commands.write_all(line.as_bytes()).and_then(|()| self.answers.read_line(&mut answer));
        let problem = match (answered, answer.trim().parse()) {
            (_, Ok(0..=3)) => return Ok(()),
            (_, Ok(PANICKED)) => "panicked".to_owned(),
            (_, Ok(code)) => format!("exit code {code}"),
            (Err(error), _) if error.kind() == ErrorKind::WouldBlock => "did not end".to_owned(),
            _ => format!("aborted: {:?}", self.child.try_wait()),
        };
        Err(format!("meniscus {}: {problem}\n{}", arguments.join(" "), self.said()))
    }

    /// The most memory that the process ever had, in MB.
    pub fn peak_memory(&self) -> u64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok()).unwrap_or_default() / 1024
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// The process itself: a line names a folder and the arguments, an answer is the exit code.
#[test]
#[ignore = "other tests run it, in a process of its own"]
fn serves() {
    if std::env::var_os(MARK).is_none() {
        return;
    }
    let mut stream = UnixStream::from(std::io::stdin().as_fd().try_clone_to_owned().unwrap());
    for line in BufReader::new(stream.try_clone().unwrap()).lines() {
        let words: Vec<String> = serde_json::from_str(&line.unwrap()).unwrap();
        std::env::set_current_dir(&words[0]).unwrap();
        let command_line = std::iter::once("meniscus".into()).chain(words[1..].iter().map(Into::into));
        let code = catch_unwind(|| meniscus::cli::obey(command_line)).unwrap_or(PANICKED);
        writeln!(stream, "{code}").unwrap();
    }
}
