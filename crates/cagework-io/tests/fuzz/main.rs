//! Mutated files through everything that reads them: each ends in a result or an error, within seconds, and without a panic.
//!
//! `cargo xtask fuzz --minutes 60` takes a seed from the clock and says which; `--seed 1` gives the same inputs in every run.
//! What fails is written to `target/fuzz`, and `cargo xtask fuzz FILE` does it again. Files that
//! failed once are kept in `found` and tried first.
//!
//! Inputs are tried in a process of its own, because a stack that overflows and memory that runs out end one. It says the number
//! of each input before it tries it; when it ends, or falls silent, the number is known and so is the input.

#[path = "../common/mod.rs"]
mod common;
mod inputs;
mod survive;

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitCode, Stdio};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Longest time on the processor for one input; the slowest takes a second.
const LIMIT: Duration = Duration::from_secs(10);

/// Longest time on the clock: whoever waits that long waits for nothing, or all others have the processor.
const PATIENCE: Duration = Duration::from_secs(600);

/// Address space of the process that tries inputs, KiB: none needs more than a few MiB.
const MEMORY_KIB: &str = "4194304";

/// Failures after which the rest of the time would be more of the same.
const MAX_FAILURES: u64 = 50;

const USAGE: &str = "usage: cargo xtask fuzz [--minutes N] [--seed S] | FILE ...";

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    match args.as_slice() {
        ["--try", seed, first] => {
            if let (Ok(seed), Ok(first)) = (seed.parse(), first.parse()) {
                try_from(seed, first);
            }
            ExitCode::FAILURE
        }
        ["--try", file] => {
            println!("0");
            match std::fs::read(file) {
                Ok(bytes) => survive::survive(&bytes),
                Err(e) => {
                    eprintln!("cannot read {file}: {e}");
                    return ExitCode::FAILURE;
                }
            }
            ExitCode::SUCCESS
        }
        [] => fuzz(1.0, None),
        ["--minutes", minutes] => minutes.parse().map_or_else(|_| usage(), |m| fuzz(m, None)),
        ["--minutes", minutes, "--seed", seed] => match (minutes.parse(), seed.parse()) {
            (Ok(minutes), Ok(seed)) => fuzz(minutes, Some(seed)),
            _ => usage(),
        },
        [first, ..] if first.starts_with("--") => usage(),
        files => try_files(files),
    }
}

/// Damaged files that once failed, in `found`.
fn found() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz/found");
    let entries = std::fs::read_dir(folder).expect("the folder is there");
    entries.map(|entry| entry.expect("it can be read").path().display().to_string()).collect()
}

fn usage() -> ExitCode {
    eprintln!("{USAGE}");
    ExitCode::from(2)
}

/// Tries inputs until somebody ends this process.
fn try_from(seed: u64, first: u64) {
    let mut inputs = inputs::Inputs::new(seed);
    let mut out = std::io::stdout().lock();
    for number in first.. {
        let said = writeln!(out, "{number}").and_then(|()| out.flush());
        if said.is_err() {
            return;
        }
        survive::survive(&inputs.get(number));
    }
}

/// A process that tries inputs, and the numbers that it says.
struct Trial {
    process: Child,
    numbers: Receiver<u64>,
    /// When the input under way was begun, and how much time the process had had on the processor.
    since: (Instant, Duration),
}

impl Trial {
    fn start(args: &[&str]) -> Self {
        let program = std::env::current_exe().expect("this program has a file");
        let mut process = Command::new("sh")
            .args(["-c", &format!("ulimit -v {MEMORY_KIB} && exec \"$0\" --try \"$@\"")])
            .arg(program)
            .args(args)
            .stdout(Stdio::piped())
            .spawn()
            .expect("there is a shell");
        let lines = BufReader::new(process.stdout.take().expect("it was asked for")).lines();
        let (send, numbers) = channel();
        std::thread::spawn(move || {
            for number in lines.map_while(Result::ok).filter_map(|line| line.parse().ok()) {
                if send.send(number).is_err() {
                    return;
                }
            }
        });
        Self { process, numbers, since: (Instant::now(), Duration::ZERO) }
    }

    /// The next input's number, and the processor's time for the one before. An error tells that the process has ended, or that it
    /// takes too long.
    fn next(&mut self) -> Result<(u64, Duration), RecvTimeoutError> {
        loop {
            let number = self.numbers.recv_timeout(Duration::from_secs(1));
            let now = (Instant::now(), self.busy().unwrap_or(self.since.1 + self.since.0.elapsed()));
            let took = now.1.saturating_sub(self.since.1);
            match number {
                Ok(number) => {
                    self.since = now;
                    return Ok((number, took));
                }
                Err(RecvTimeoutError::Timeout) if took < LIMIT && self.since.0.elapsed() < PATIENCE => {}
                Err(e) => return Err(e),
            }
        }
    }

    /// How long the process has been on the processor, as Linux counts it: in hundredths of a second.
    fn busy(&self) -> Option<Duration> {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.process.id())).ok()?;
        let fields: Vec<&str> = stat.rsplit_once(')')?.1.split_whitespace().collect();
        let ticks = |k: usize| fields.get(k)?.parse::<u64>().ok();
        Some(Duration::from_millis(10 * (ticks(11)? + ticks(12)?)))
    }

    /// How it ended; none if all is well.
    fn end(mut self, timed_out: bool) -> Option<String> {
        if timed_out {
            // It may have ended by itself meanwhile.
            let _ = self.process.kill();
        }
        match self.process.wait() {
            _ if timed_out => Some(format!("not done after {} s", LIMIT.as_secs())),
            Ok(status) if status.success() => None,
            Ok(status) => Some(format!("ended with {status}")),
            Err(e) => Some(e.to_string()),
        }
    }
}

/// Tries what `target/fuzz` or anybody else has kept.
fn try_files(files: &[impl AsRef<Path> + std::fmt::Display]) -> ExitCode {
    let mut outcome = ExitCode::SUCCESS;
    for file in files {
        let path = root().join(file);
        let mut trial = Trial::start(&[&path.display().to_string()]);
        let began = Instant::now();
        // Its number, then nothing.
        let ended = trial.next().and_then(|_| trial.next());
        match trial.end(matches!(ended, Err(RecvTimeoutError::Timeout))) {
            None => println!("{file}: survived in {} ms", began.elapsed().as_millis()),
            Some(how) => {
                println!("{file}: {how}");
                outcome = ExitCode::FAILURE;
            }
        }
    }
    outcome
}

/// Tries inputs for some minutes. Success if all of them have ended well.
fn fuzz(minutes: f64, seed: Option<u64>) -> ExitCode {
    let clock = || std::time::UNIX_EPOCH.elapsed().map_or(0, |d| d.as_secs());
    let seed = seed.unwrap_or_else(clock);
    println!("fuzz: seed {seed}, {minutes} minutes");
    if try_files(&found()) != ExitCode::SUCCESS {
        return ExitCode::FAILURE;
    }
    let began = Instant::now();
    let until = began + Duration::from_secs_f64(60.0 * minutes.clamp(0.0, 1e5));
    let (mut next, mut failures, mut said) = (0, 0, began);
    let (mut slowest, mut slowest_number) = (Duration::ZERO, 0);
    while Instant::now() < until && failures < MAX_FAILURES {
        let mut trial = Trial::start(&[&seed.to_string(), &next.to_string()]);
        let mut current = next;
        let ended = loop {
            match trial.next() {
                Ok((number, took)) => {
                    if number > current && took > slowest {
                        (slowest, slowest_number) = (took, current);
                    }
                    current = number;
                    if Instant::now() >= until {
                        break None;
                    }
                    if said.elapsed() > Duration::from_secs(60) {
                        said = Instant::now();
                        println!("fuzz: {current} inputs, {failures} failures so far");
                    }
                }
                Err(e) => break Some(e),
            }
        };
        let how = trial.end(ended != Some(RecvTimeoutError::Disconnected));
        // The input under way when the time is over is not counted.
        next = current + u64::from(ended.is_some());
        if ended.is_some() {
            failures += 1;
            let how = how.unwrap_or_else(|| "ended".to_owned());
            match keep(seed, current) {
                Ok(path) => println!(
                    "fuzz: input {current} of seed {seed} {how}; again: cargo xtask fuzz {}",
                    path.display()
                ),
                Err(e) => println!("fuzz: input {current} of seed {seed} {how}; it cannot be kept: {e}"),
            }
        }
    }
    println!(
        "fuzz: seed {seed}, {next} inputs in {} s, {failures} failures; the slowest, input {slowest_number}, took {} ms",
        began.elapsed().as_secs(),
        slowest.as_millis()
    );
    if failures == 0 { ExitCode::SUCCESS } else { ExitCode::FAILURE }
}

/// Writes an input down; its path from the repository's root.
fn keep(seed: u64, number: u64) -> std::io::Result<PathBuf> {
    let path = Path::new("target/fuzz").join(format!("{seed}-{number}"));
    std::fs::create_dir_all(root().join("target/fuzz"))?;
    std::fs::write(root().join(&path), inputs::Inputs::new(seed).get(number))?;
    Ok(path)
}

/// The repository's root; tests run in the folder of their crate.
fn root() -> PathBuf {
    // crates/cagework-io is two levels below it.
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .ancestors()
        .nth(2)
        .expect("the crate lies in the repository")
        .to_path_buf()
}
