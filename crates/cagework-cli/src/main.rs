//! The `cagework` command: bind a mesh to a cage by harmonic coordinates, deform it, and say how well that went.
//!
//! Results go to stdout (`--json`: as JSON), errors to stderr. Exit code 0: done, 1: error, 2: wrong command line.

mod args;
mod bench;
mod bind;
mod cage;
mod card;
mod check;
mod controls;
mod deform;
mod demo;
mod dynamic;
mod error;
mod evaluate;
mod files;
mod fit;
mod gpu;
mod info;
mod load;
mod pose;
mod progress;
mod pull;
mod refit;
mod render;
mod rig;
mod signals;

use std::process::ExitCode;

use args::{Cli, Command};
use clap::Parser as _;

/// A bind allocates and frees some 30 MB in a few milliseconds; the system's allocator hands such blocks back and
/// forth to the kernel, and a fifth of a bind at g = 64 went into page faults.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

fn main() -> ExitCode {
    let cli = Cli::parse();
    signals::listen(files::abandon);
    let outcome = match &cli.command {
        Command::Info(args) => info::run(args, cli.json),
        Command::Bind(args) => bind::run(args, cli.json),
        Command::Deform(args) => deform::run(args, cli.json),
        Command::Refit(args) => refit::run(args, cli.json),
        Command::Pull(args) => pull::run(args, cli.json),
        Command::Fit(args) => fit::run(args, cli.json),
        Command::Render(args) => render::run(args, cli.json),
        Command::Cage(args) => cage::run(args, cli.json),
        Command::Check(args) => check::run(args, cli.json),
        Command::Bench(args) => bench::run(args, cli.json),
        Command::Evaluate(args) => evaluate::run(args, cli.json),
        Command::Demo(args) => demo::run(args, cli.json),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            error::say(&error.message(), error.hint());
            ExitCode::FAILURE
        }
    }
}
