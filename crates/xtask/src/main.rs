//! The repository's own tasks, called through `npm start`, `npm test`, `npm run build` and `npm run check`.
//!
//! `cargo xtask TASK` does the same if Rust is installed; `crates/xtask/run.sh` installs it.

mod advisories;
mod arrows;
mod command;
mod deny;
mod licences;
mod npm;
mod package;
mod parts;
mod python;
mod release;
mod site;
mod tasks;
mod wasm;

use std::process::ExitCode;

use tasks::Tier;

const USAGE: &str = "usage: cargo xtask TASK

  start [ARGS]   build the page and serve it on this machine (ARGS for `vite preview`: --port 8080, --open)
  build          build the page into dist/, and the release `cagework` (target/release/cagework)
  test           what a change needs: the Rust and TypeScript tests, and one story per step of the page in Chromium
  test-all       also the other tests of the page, Firefox, the packages, the glTF validator, damaged files
  test-long      the Blender extension, the notebooks, the evaluation, damaged files for two hours, and for half an
                 hour on the page
  check          format, lints, documentation, dependency arrows, import circles, types, biome
  fuzz [--minutes N] [--seed S] | --page N | FILE ...
                 damaged files through all that reads them, with --page through the page's wasm modules; what fails
                 is kept in target/fuzz, and FILE is tried again
  check-and-build  `check` during the build of the tests, with the compiler that `.ci/run` sets
  check-scripts  the part of `check` that is about TypeScript
  test-beside    the part of `test-all` that runs beside the Rust tests: TypeScript, Firefox, packages, the page's build
  test-scripts-beside  the same for `test`: TypeScript, the page's build
  arrows         the dependency arrows of ARCHITECTURE.md and import circles only
  python [ARGS]  the Python package only, built with the Rust tests and tested against the command (ARGS for pytest)
  blender        the Blender extension: built, and tested in Blender as a Python package (needs Python 3.11)
  notebooks      the notebook widget in JupyterLab, and the example notebooks (600 MB to download)
  notebook-wheel the notebook widget's wheel, into target/notebook
  wheel [ARGS]   the Python package's release wheel, into target/wheels (ARGS for `maturin build`)
  wheel-notices  the licences that the wheel contains, for other builds of it
  archive [TARGET]  the release `cagework` with its licences, for this machine or TARGET, into target/archives
  release-check TAG  whether versions, changelog and addresses are ready to be released as TAG
  advisories FOLDER  the committed snapshot of the RustSec database, from a clone of it
  npm            the npm package only: packed, installed into a blank project and tested there, in Node and in a browser
  npm-pack       the npm package, packed into target/npm
  wasm [--dev]   crates/cagework-web as a JavaScript package, web/package/src/pkg
  page           build the page only
  scripts [ARGS] the TypeScript tests that need no browser (ARGS for Vitest)
  firefox        build the page and test it in Firefox
  exports        exported files through the Khronos validator and three.js
  page-test [ARGS]  build the page and test it in a browser (ARGS for Playwright)
  pictures       make the pictures of the samples that the page shows
  demo [ARGS]    build the release `cagework` and run `cagework demo ARGS` on the built-in sample";

fn main() -> ExitCode {
    let args: Vec<String> = std::env::args().skip(1).collect();
    let args: Vec<&str> = args.iter().map(String::as_str).collect();
    let outcome = match args.as_slice() {
        ["start", rest @ ..] => site::start(rest),
        ["page"] => site::build(),
        ["page-test", rest @ ..] => site::test_page(rest),
        ["pictures"] => site::pictures(),
        ["demo", rest @ ..] => tasks::demo(rest),
        ["build"] => tasks::build(),
        ["test"] => tasks::test(Tier::Change),
        ["test-all"] => tasks::test(Tier::All),
        ["test-long"] => tasks::test_long(),
        ["fuzz", rest @ ..] => tasks::fuzz(rest),
        ["advisories", folder] => advisories::update(folder.as_ref()),
        ["check"] => tasks::check(),
        ["check-and-build"] => tasks::check_and_build(),
        ["test-beside"] => tasks::test_beside(Tier::All),
        ["test-scripts-beside"] => tasks::test_beside(Tier::Change),
        ["scripts", rest @ ..] => site::test_scripts(rest),
        ["firefox"] => site::build().and_then(|()| site::test_firefox()),
        ["exports"] => tasks::build_tests().and_then(|()| tasks::validate_exports()),
        ["check-scripts"] => tasks::check_scripts(),
        ["python", rest @ ..] => tasks::build_tests().and_then(|()| python::test(rest)),
        ["blender"] => python::test_blender(),
        ["notebooks"] => python::test_notebooks(),
        ["notebook-wheel"] => python::notebook_wheel().map(|wheel| println!("{wheel}")),
        ["wheel", rest @ ..] => python::wheel(rest),
        ["wheel-notices"] => python::write_notices(),
        ["archive"] => release::archive(None).map(|archive| println!("{archive}")),
        ["archive", target] => release::archive(Some(target)).map(|archive| println!("{archive}")),
        ["release-check", tag] => release::check(tag),
        ["npm"] => package::test(),
        ["npm-pack"] => package::pack().map(drop),
        ["arrows"] => arrows::check(),
        ["wasm"] => wasm::build(wasm::Profile::Web),
        ["wasm", "--dev"] => wasm::build(wasm::Profile::Dev),
        _ => {
            eprintln!("{USAGE}");
            return ExitCode::from(2);
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("error: {message}");
            ExitCode::FAILURE
        }
    }
}
