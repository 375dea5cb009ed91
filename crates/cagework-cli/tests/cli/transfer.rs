//! `cagework transfer` on the humanoid sample and a suit around it.

use cagework_cage::samples;
use cagework_core::deform::vertex_normals;
use cagework_io::write_mesh_glb;
use predicates::prelude::*;
use predicates::str::contains;

use crate::support::Sandbox;

#[test]
fn clothes_get_joints_and_what_does_not_fit_is_refused() {
    let sandbox = Sandbox::new();
    let sample = samples::build("humanoid").unwrap();
    sandbox.write("body.glb", write_mesh_glb("body", &sample.mesh, &[], sample.rig.as_ref()).unwrap());
    let mut suit = sample.mesh;
    let normals = vertex_normals(&suit.positions, &suit.triangles);
    suit.positions.iter_mut().zip(normals).for_each(|(p, normal)| *p += 0.005 * normal);
    sandbox.write("suit.glb", write_mesh_glb("suit", &suit, &[], None).unwrap());
    sandbox
        .run("transfer body.glb suit.glb -o out.glb")
        .success()
        .stdout(contains("positions like the closest point of the body").and(contains("wrote out.glb")));
    let info = sandbox.json("info out.glb --json");
    assert_eq!((&info["skins"], &info["joints"]), (&1.into(), &16.into()));

    let pushed = sandbox.json("transfer body.glb suit.glb --push-out 0.01 -o far.glb --json");
    assert_eq!((&pushed["rest"]["left"]["count"], &pushed["joints"]), (&0.into(), &16.into()));

    let refused = |args: &str, what: &str| drop(sandbox.run(args).failure().stderr(contains(what)));
    refused("transfer suit.glb suit.glb -o no.glb", "suit.glb has no skin");
    refused("transfer body.glb body.glb -o no.glb", "body.glb has a skin already");
    refused("transfer body.glb suit.glb --push-out 0 -o no.glb", "--push-out");
    refused("transfer body.glb suit.glb -o no.obj", "the name must end in .glb");
    refused("transfer body.glb suit.glb -o body.glb", "body.glb");
    suit.positions.iter_mut().for_each(|p| *p *= 100.0);
    sandbox.write("large.glb", write_mesh_glb("large", &suit, &[], None).unwrap());
    refused("transfer body.glb large.glb -o no.glb", "no vertex of large.glb is near the body");
    assert!(!sandbox.names().contains(&"no.glb".to_owned()));
}
