//! `mte-slam objects`.
use crate::{
    args::ObjectsArgs,
    output::{folder::replace_file, trajectory::read_tum},
    screen::Screen,
};
use anyhow::{Context, Result, bail};
use glam::DVec3;
use mte_slam_mesh::Mesh;
use mte_slam_objects::{
    ObjectOptions, Objects, cameras_up, class_mesh, find_objects, level_up, ply_classes,
    write_json, write_objects_glb,
};
use std::{fmt::Write, fs, path::Path};

/// Makes objects of the mesh of an output folder.
pub fn run(args: &ObjectsArgs, screen: Screen) -> Result<()> {
    let out = &args.out;
    if !out.is_dir() {
        bail!(
            "{}: found no folder of that name, expected the output folder of a run",
            out.display()
        );
    }
    let (colored, semantic) = (out.join("mesh.ply"), out.join("mesh_semantic.ply"));
    let classes = ply_classes(&read(&semantic)?).with_context(|| semantic.display().to_string())?;
    let mesh =
        class_mesh(&read(&colored)?, &classes).with_context(|| colored.display().to_string())?;
    let options = ObjectOptions {
        up: up(args, &mesh, screen)?,
        gap_m: args.gap,
        min_area_m2: args.min_area,
        min_triangles: args.min_triangles,
        structure: args.structure.clone(),
    };
    if !classes.classes.iter().any(|c| options.is_structure(&c.name)) {
        let names = args.structure.join(", ");
        screen
            .note(&format!("note: no class is named {names}, so none is structure (--structure)"));
    }
    let failed = || format!("{}: no objects can be made of the mesh", out.display());
    let found = find_objects(&mesh, &classes, None, &options).with_context(failed)?;
    let json = write_json(&found, &options);
    let glb = write_objects_glb(&mesh, &found).with_context(failed)?;
    replace_file(&out.join("objects.json"), &json)?;
    replace_file(&out.join("objects.glb"), &glb)?;
    screen.result(&text(&found, out), &String::from_utf8_lossy(&json));
    Ok(())
}

fn read(path: &Path) -> Result<Vec<u8>> {
    fs::read(path).with_context(|| {
        format!(
            "{}: cannot be read, expected a mesh as a run with labels writes it",
            path.display()
        )
    })
}

/// Up as given, else that of the cameras, made level.
fn up(args: &ObjectsArgs, mesh: &Mesh, screen: Screen) -> Result<DVec3> {
    if let Some(up) = args.up {
        return Ok(up);
    }
    let path = args.out.join("trajectory.txt");
    let poses = if path.is_file() {
        let name = path.display().to_string();
        read_tum(
            &name,
            &fs::read_to_string(&path).with_context(|| format!("{name}: cannot be read"))?,
        )?
    } else {
        Vec::new()
    };
    match cameras_up(poses.iter().map(|(_, pose)| pose)) {
        Some(near) => Ok(level_up(mesh, near)?),
        None => {
            let what = "says of no direction that it is up; taking z (see --up)";
            screen.note(&format!("WARNING: {}: {what}", path.display()));
            Ok(DVec3::Z)
        }
    }
}

fn text(found: &Objects, out: &Path) -> String {
    let width = found.objects.iter().map(|o| o.name.chars().count()).max().unwrap_or(0).max(6);
    let mut text =
        format!("{:width$}   extent x, y, up [m]   area [m2]  confidence  seen\n", "object");
    for o in &found.objects {
        let e = o.bounds.extent();
        let _ = writeln!(
            text,
            "{:width$}   {:5.2} {:5.2} {:5.2}   {:11.3}       {:5.2} {:5.2}{}",
            o.name,
            e.x,
            e.y,
            e.z,
            o.area_m2,
            o.confidence,
            o.visible_share,
            if o.structure { "  structure" } else { "" }
        );
    }
    let things = found.objects.iter().filter(|o| !o.structure).count();
    let (d, u) = (&found.dropped, &found.unlabeled);
    let _ = writeln!(
        text,
        "\n{things} objects, {} surfaces of structure; left out {} small parts ({:.3} m2) and {:.3} \
         m2 without a class\nyaw {:.2} degrees, which {:.0} % of the upright surface keeps\n{}",
        found.objects.len() - things,
        d.parts,
        d.area_m2,
        u.area_m2,
        found.axes.yaw_deg,
        100.0 * found.axes.aligned_share,
        ["objects.json", "objects.glb"].map(|name| out.join(name).display().to_string()).join(", ")
    );
    text
}
