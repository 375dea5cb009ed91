//! Generates cages of 24, 80 and 200 vertices for the samples and for the models on the command line, checks and binds
//! them, and prints a Markdown table. Exits with an error if a cage is invalid or its rest error too large.
//!
//! `cargo bench -p cagework-benches --bench cages -- horse.glb cow.obj`

use cagework_benches::read;
use cagework_cage::check::check;
use cagework_cage::generate::{CageOptions, generate};
use cagework_cage::samples;
use cagework_core::bind::bind;
use cagework_core::mesh::TriMesh;
use cagework_core::options::BindOptions;
use cagework_core::progress::NoProgress;

/// Target numbers of cage vertices; 80 is the default of the options.
const TARGETS: [u32; 3] = [24, 80, 200];

/// Number of cells of the bind grid along the longest side of the cage.
const GRID: u32 = 64;

/// Largest allowed rest error of a vertex, as a fraction of the cage's diagonal.
const MAX_REST_ERROR: f64 = 5e-5;

/// Number of times that each cage is generated for timing; the table shows the shortest time.
const TIMES: usize = 5;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    // `cargo test --benches` also runs this program, without `--bench`. Skip the measurements then.
    if !arguments.iter().any(|argument| argument == "--bench") {
        return;
    }
    let files = arguments.iter().filter(|argument| !argument.starts_with("--"));
    let mut models: Vec<(String, TriMesh)> = samples::all()
        .iter()
        .filter_map(|info| Some((info.label.to_owned(), samples::build(info.id)?.mesh)))
        .collect();
    models.extend(files.map(|file| {
        let name = std::path::Path::new(file).file_stem().map_or(file.clone(), |s| s.display().to_string());
        (name, read(file).tri_mesh())
    }));
    println!(
        "| model | triangles | target | vertices | mirror | clearance / diagonal | valid | model inside | \
        largest rest error | time, ms |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let mut wrong = 0;
    for (name, mesh) in &models {
        for target in TARGETS {
            wrong += u32::from(!row(name, mesh, target));
        }
    }
    if wrong > 0 {
        eprintln!("{wrong} of {} cages failed", models.len() * TARGETS.len());
        std::process::exit(1);
    }
}

/// Prints a row of the table. Returns whether the cage is valid, encloses the model and has a small rest error.
fn row(name: &str, mesh: &TriMesh, target: u32) -> bool {
    let options = CageOptions { target, ..CageOptions::default() };
    let run = || generate(&mesh.positions, &mesh.triangles, &options, &NoProgress);
    let generated = match run() {
        Ok(generated) => generated,
        Err(error) => {
            println!("| {name} | {} | {target} | {error} |", mesh.triangles.len());
            return false;
        }
    };
    let fastest = cagework_benches::fastest_ms(TIMES, || drop(run()));
    let checked = check(&generated.cage.to_polygon_mesh(), Some(&mesh.positions), None);
    let options = BindOptions { grid: GRID, ..BindOptions::default() };
    let bound = bind(&mesh.positions, &generated.cage, &options, &NoProgress);
    let (outside, rest) = match &bound {
        Ok(binding) => (binding.report.outside_vertices, binding.report.rest_error.max_rel),
        Err(_) => (mesh.positions.len() as u64, f64::INFINITY),
    };
    let inside = checked.encloses == Some(true) && outside == 0;
    println!(
        "| {name} | {} | {target} | {}{} | {} | {:.3} | {} | {} | {rest:.1e} | {fastest:.0} |",
        mesh.triangles.len(),
        generated.report.vertices,
        if generated.report.target_met { "" } else { " (needs more)" },
        generated.report.mirror.map_or("-".to_owned(), |mirror| format!("{mirror:?}").to_lowercase()),
        f64::from(generated.report.clearance) / generated.cage.diagonal() as f64,
        if checked.valid { "yes" } else { "**no**" },
        if inside { "yes" } else { "**no**" },
    );
    checked.valid && inside && rest <= MAX_REST_ERROR
}
