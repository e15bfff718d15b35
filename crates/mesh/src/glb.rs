//! glTF 2.0 binary (GLB) bytes of a mesh.
//!
//! glTF is y-up by convention, while a world frame here has whatever "up" its data set has: the
//! node keeps the identity and coordinates are those of the poses. Vertex colours are linear in
//! glTF, so sRGB is converted, with 16 bits per channel to keep dark tones apart.
use super::{Mesh, MeshError};
use alloc::{
    collections::BTreeMap,
    format,
    string::{String, ToString},
    vec::Vec,
};
use mte_slam_types::classes::{ClassTable, UNLABELLED};
#[cfg(not(feature = "std"))]
use num_traits::Float as _;

const VERTICES: u32 = 34962;
const INDICES: u32 = 34963;
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;
const UNLIT: &str = "KHR_materials_unlit";
// The colours are as photographed, lighting included: viewers that can show them unlit.
const VERTEX_COLORS: &str = r#"{"name":"vertex colours","doubleSided":true,"pbrMetallicRoughness":{"metallicFactor":0,"roughnessFactor":1},"extensions":{"KHR_materials_unlit":{}}}"#;

/// A value in the `extras` of a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum GlbExtra<'a> {
    /// A number; it must be finite.
    Number(f64),
    /// A text.
    Text(&'a str),
    /// True or false.
    Flag(bool),
}

/// A part of a mesh that becomes a node of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct GlbNode<'a> {
    /// The node's name.
    pub name: &'a str,
    /// Indices of its triangles in the mesh.
    pub triangles: &'a [u32],
    /// Keys and values of its `extras`.
    pub extras: Vec<(&'a str, GlbExtra<'a>)>,
}

/// The mesh with POSITION, NORMAL and COLOR_0 as far as it has them, as one primitive.
///
/// # Errors
/// A mesh that fails [`Mesh::check`] or has non-finite positions, or 4 GiB of data.
pub fn write_glb(mesh: &Mesh) -> Result<Vec<u8>, MeshError> {
    mesh.check()?;
    let mut glb = Glb::default();
    glb.add_vertices(mesh, true)?;
    let indices: Vec<u32> = mesh.triangles.iter().flatten().copied().collect();
    glb.add_primitive(&indices, VERTEX_COLORS);
    glb.finish()
}

/// Returns the mesh with one primitive and one flat, named material per class. A triangle has the class of
/// most of its vertices, else of its first.
///
/// # Errors
/// As [`write_glb`], or a mesh without classes.
pub fn write_glb_by_class(mesh: &Mesh, classes: &ClassTable) -> Result<Vec<u8>, MeshError> {
    mesh.check()?;
    if mesh.classes.len() != mesh.positions.len() {
        return Err(invalid("classes of the mesh", "none", "one a vertex"));
    }
    let mut glb = Glb::default();
    let mut by_class: BTreeMap<u8, Vec<u32>> = BTreeMap::new();
    for (i, t) in mesh.triangles.iter().enumerate() {
        let class = mesh.triangle_class(i).unwrap_or(UNLABELLED);
        by_class.entry(class).or_default().extend(t);
    }
    for (class, indices) in by_class {
        let (name, color) = match classes.classes.get(class as usize) {
            Some(c) => (c.name.as_str(), c.color),
            None => ("unlabelled", [128; 3]),
        };
        let [r, g, b] = color.map(linear);
        let material = format!(
            r#"{{"name":{},"doubleSided":true,"pbrMetallicRoughness":{{"baseColorFactor":[{r},{g},{b},1],"metallicFactor":0,"roughnessFactor":1}}}}"#,
            quoted(name)
        );
        // Vertices of its own: viewers that copy those of each primitive would copy all of them.
        let (part, indices) = part_of(mesh, &indices);
        glb.add_vertices(&part, false)?;
        glb.add_primitive(&indices, &material);
    }
    glb.finish()
}

/// Returns parts of the mesh as nodes of one scene, each with a mesh of its own that holds the vertices
/// it uses, with colours as [`write_glb`] has them. A node without triangles has no mesh;
/// where none has any, the scene is empty.
///
/// # Errors
/// As [`write_glb`], or a triangle that the mesh does not have, or a number that is not finite.
pub fn write_glb_nodes(mesh: &Mesh, nodes: &[GlbNode<'_>]) -> Result<Vec<u8>, MeshError> {
    mesh.check()?;
    let mut glb = Glb::default();
    for node in nodes {
        let mut corners = Vec::with_capacity(node.triangles.len().saturating_mul(3));
        for &t in node.triangles {
            let Some(triangle) = mesh.triangles.get(t as usize) else {
                let expected = format!("less than {}", mesh.triangles.len());
                return Err(invalid("triangle of a node", t, &expected));
            };
            corners.extend_from_slice(triangle);
        }
        let mut extras = Vec::new();
        for (key, value) in &node.extras {
            let value = match value {
                GlbExtra::Number(x) if x.is_finite() => format!("{x}"),
                GlbExtra::Number(x) => {
                    return Err(invalid("extra of a node", x, "a finite number"));
                }
                GlbExtra::Text(text) => quoted(text),
                GlbExtra::Flag(flag) => format!("{flag}"),
            };
            extras.push(format!("{}:{value}", quoted(key)));
        }
        let (part, indices) = part_of(mesh, &corners);
        glb.add_vertices(&part, true)?;
        let before = glb.primitives.len();
        glb.add_primitive_with(&indices, VERTEX_COLORS, 0);
        let shape = if glb.primitives.len() > before {
            format!(r#","mesh":{before}"#)
        } else {
            String::new()
        };
        glb.nodes.push(format!(
            r#"{{"name":{}{shape},"extras":{{{}}}}}"#,
            quoted(node.name),
            extras.join(",")
        ));
    }
    glb.finish()
}

/// Returns the vertices that the corners of some triangles use, and the corners' indices among them.
fn part_of(mesh: &Mesh, corners: &[u32]) -> (Mesh, Vec<u32>) {
    let mut part = Mesh::default();
    let mut place = BTreeMap::new();
    let indices = corners
        .iter()
        .map(|&i| {
            *place.entry(i).or_insert_with(|| {
                part.positions.push(mesh.positions[i as usize]);
                part.normals.extend(mesh.normals.get(i as usize));
                part.colors.extend(mesh.colors.get(i as usize));
                part.positions.len() as u32 - 1
            })
        })
        .collect();
    (part, indices)
}

fn invalid(what: &'static str, found: impl ToString, expected: &str) -> MeshError {
    MeshError::Invalid { what, found: found.to_string(), expected: expected.into() }
}

/// sRGB byte to linear 0..1.
fn linear(srgb: u8) -> f64 {
    let s = f64::from(srgb) / 255.0;
    if s <= 0.04045 { s / 12.92 } else { ((s + 0.055) / 1.055).powf(2.4) }
}

/// Returns a JSON string.
fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' | '\\' => {
                out.push('\\');
                out.push(c);
            }
            c if u32::from(c) < 0x20 => out += &format!("\\u{:04x}", u32::from(c)),
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// Collects the binary chunk and the JSON objects that refer to it.
#[derive(Default)]
struct Glb {
    binary: Vec<u8>,
    views: Vec<String>,
    accessors: Vec<String>,
    primitives: Vec<String>,
    materials: Vec<String>,
    attributes: String,
    /// Nodes with a mesh per primitive; without any, one node shows all primitives.
    nodes: Vec<String>,
}

impl Glb {
    /// Vertices of the primitives added from now on.
    fn add_vertices(&mut self, mesh: &Mesh, colors: bool) -> Result<(), MeshError> {
        let n = mesh.positions.len();
        if n == 0 {
            return Ok(());
        }
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for p in &mesh.positions {
            if !p.iter().all(|x| x.is_finite()) {
                return Err(invalid("vertex position", format!("{p:?}"), "finite numbers"));
            }
            for a in 0..3 {
                (low[a], high[a]) = (low[a].min(p[a]), high[a].max(p[a]));
            }
        }
        let bounds = format!(r#","min":{low:?},"max":{high:?}"#);
        let data = bytemuck::cast_slice(&mesh.positions);
        let position = self.accessor(data, VERTICES, F32, "VEC3", n, &bounds);
        self.attributes = format!(r#""POSITION":{position}"#);
        if !mesh.normals.is_empty() {
            // The format asks for unit normals; an undefined one gets any direction.
            let unit: Vec<[f32; 3]> = mesh.normals.iter().map(|&v| unit_or_z(v)).collect();
            let normal = self.accessor(bytemuck::cast_slice(&unit), VERTICES, F32, "VEC3", n, "");
            self.attributes += &format!(r#","NORMAL":{normal}"#);
        }
        if colors && !mesh.colors.is_empty() {
            let table: Vec<u16> = (0..=255).map(|s| (linear(s) * 65535.0 + 0.5) as u16).collect();
            let rgba: Vec<[u16; 4]> = mesh
                .colors
                .iter()
                .map(|c| [table[c[0] as usize], table[c[1] as usize], table[c[2] as usize], 65535])
                .collect();
            let data = bytemuck::cast_slice(&rgba);
            let color = self.accessor(data, VERTICES, U16, "VEC4", n, r#","normalized":true"#);
            self.attributes += &format!(r#","COLOR_0":{color}"#);
        }
        Ok(())
    }

    /// Appends data (a multiple of 4 bytes) and describes it. Returns the accessor's index.
    fn accessor(
        &mut self,
        data: &[u8],
        target: u32,
        component: u32,
        shape: &str,
        count: usize,
        more: &str,
    ) -> usize {
        self.views.push(format!(
            r#"{{"buffer":0,"byteOffset":{},"byteLength":{},"target":{target}}}"#,
            self.binary.len(),
            data.len()
        ));
        self.binary.extend_from_slice(data);
        self.accessors.push(format!(
            r#"{{"bufferView":{},"componentType":{component},"type":"{shape}","count":{count}{more}}}"#,
            self.views.len() - 1
        ));
        self.accessors.len() - 1
    }

    fn add_primitive(&mut self, indices: &[u32], material: &str) {
        self.add_primitive_with(indices, material, self.materials.len());
    }

    /// Adds a primitive with the material of this index, which is added if it is the next one.
    fn add_primitive_with(&mut self, indices: &[u32], material: &str, index: usize) {
        if indices.is_empty() {
            return; // accessors of nothing are not allowed
        }
        let data = bytemuck::cast_slice(indices);
        let accessor = self.accessor(data, INDICES, U32, "SCALAR", indices.len(), "");
        if index == self.materials.len() {
            self.materials.push(material.into());
        }
        self.primitives.push(format!(
            r#"{{"attributes":{{{}}},"indices":{accessor},"material":{index}}}"#,
            self.attributes
        ));
    }

    /// The scene, its nodes and their meshes.
    fn scene(&self) -> String {
        if self.nodes.is_empty() {
            return format!(
                r#""scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{}]}}]"#,
                self.primitives.join(",")
            );
        }
        let numbers: Vec<String> = (0..self.nodes.len()).map(|i| i.to_string()).collect();
        let meshes: Vec<String> =
            self.primitives.iter().map(|p| format!(r#"{{"primitives":[{p}]}}"#)).collect();
        format!(
            r#""scene":0,"scenes":[{{"nodes":[{}]}}],"nodes":[{}],"meshes":[{}]"#,
            numbers.join(","),
            self.nodes.join(","),
            meshes.join(",")
        )
    }

    fn finish(self) -> Result<Vec<u8>, MeshError> {
        let mut json = String::from(r#"{"asset":{"version":"2.0","generator":"mte-slam"}"#);
        if self.primitives.is_empty() {
            json += r#","scene":0,"scenes":[{}]}"#;
        } else {
            if self.materials.iter().any(|m| m.contains(UNLIT)) {
                json += &format!(r#","extensionsUsed":["{UNLIT}"]"#);
            }
            json += &format!(
                r#",{},"materials":[{}],"accessors":[{}],"bufferViews":[{}],"buffers":[{{"byteLength":{}}}]}}"#,
                self.scene(),
                self.materials.join(","),
                self.accessors.join(","),
                self.views.join(","),
                self.binary.len()
            );
        }
        while !json.len().is_multiple_of(4) {
            json.push(' ');
        }
        // Without primitives nothing may refer to the buffer.
        let binary = if self.primitives.is_empty() { &[][..] } else { &self.binary[..] };
        let chunk = if binary.is_empty() { 0 } else { 8 + binary.len() };
        let total = 12 + 8 + json.len() + chunk;
        let Ok(total32) = u32::try_from(total) else {
            return Err(invalid("GLB size", format!("{total} bytes"), "less than 4 GiB"));
        };
        let mut out = Vec::with_capacity(total);
        out.extend_from_slice(b"glTF");
        out.extend_from_slice(&2u32.to_le_bytes());
        out.extend_from_slice(&total32.to_le_bytes());
        out.extend_from_slice(&(json.len() as u32).to_le_bytes());
        out.extend_from_slice(b"JSON");
        out.extend_from_slice(json.as_bytes());
        if !binary.is_empty() {
            out.extend_from_slice(&(binary.len() as u32).to_le_bytes());
            out.extend_from_slice(b"BIN\0");
            out.extend_from_slice(binary);
        }
        Ok(out)
    }
}

fn unit_or_z(n: [f32; 3]) -> [f32; 3] {
    match super::to_dvec3(n).try_normalize() {
        Some(n) => n.to_array().map(|x| x as f32),
        None => [0.0, 0.0, 1.0],
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_shapes::square;
    use alloc::vec;
    use mte_slam_types::classes::Class;

    /// Length of the chunk of this kind at `at`, and its bytes.
    fn chunk<'a>(glb: &'a [u8], at: usize, kind: &[u8; 4]) -> &'a [u8] {
        let n = u32::from_le_bytes(*glb[at..].first_chunk().unwrap()) as usize;
        assert_eq!(&glb[at + 4..at + 8], kind);
        assert_eq!(n % 4, 0);
        &glb[at + 8..at + 8 + n]
    }

    fn colored() -> Mesh {
        let mut m = square(2, 1.0, 0.5);
        m.compute_normals();
        m.colors = vec![[0, 128, 255]; 9];
        m.classes = vec![0, 0, 0, 1, 1, 1, 255, 255, 255];
        m
    }

    #[test]
    fn container_is_well_formed() {
        let glb = write_glb(&colored()).unwrap();
        assert_eq!(&glb[..4], b"glTF");
        assert_eq!(u32::from_le_bytes(*glb[8..].first_chunk().unwrap()) as usize, glb.len());
        let json = core::str::from_utf8(chunk(&glb, 12, b"JSON")).unwrap();
        let binary = chunk(&glb, 20 + json.len(), b"BIN\0");
        assert_eq!(binary.len(), 9 * (12 + 12 + 8) + 8 * 12);
        assert!(json.contains(r#""min":[0.0, 0.0, 0.5],"max":[1.0, 1.0, 0.5]"#), "{json}");
        // 128 in sRGB is 0.2159 linear.
        let rgba: [u8; 8] = binary[9 * 24..9 * 24 + 8].try_into().unwrap();
        assert_eq!(u16::from_le_bytes([rgba[2], rgba[3]]), 14146);
        assert_eq!((rgba[0], rgba[4], rgba[7]), (0, 255, 255));
    }

    #[test]
    fn one_material_a_class() {
        let class = |name: &str| Class { raw_id: 1, name: name.into(), color: [10, 20, 30] };
        let table = ClassTable { classes: vec![class("wall"), class("a \"chair\"\n")] };
        let glb = write_glb_by_class(&colored(), &table).unwrap();
        let json = core::str::from_utf8(chunk(&glb, 12, b"JSON")).unwrap();
        assert!(json.contains(r#""name":"a \"chair\"\u000a""#) && json.contains("wall"));
        assert!(json.contains("unlabelled") && !json.contains("COLOR_0"));
        assert_eq!(json.matches("\"indices\"").count(), 3);
        // Each primitive has the vertices that it uses, not all 9: 5 of class 0, 7 of 1, 5 of none.
        let json: serde_json::Value = serde_json::from_str(json).unwrap();
        let primitives = json["meshes"][0]["primitives"].as_array().unwrap();
        let vertices: Vec<u64> = primitives
            .iter()
            .map(|p| p["attributes"]["POSITION"].as_u64().unwrap() as usize)
            .map(|i| json["accessors"][i]["count"].as_u64().unwrap())
            .collect();
        assert_eq!(vertices, [5, 7, 5]);
        assert!(write_glb_by_class(&square(1, 1.0, 0.0), &table).is_err());
    }

    #[test]
    fn one_node_a_part() {
        let mesh = colored();
        let extras = vec![
            ("id", GlbExtra::Number(3.0)),
            ("class", GlbExtra::Text("a \"chair\"")),
            ("structure", GlbExtra::Flag(false)),
        ];
        let node = |name, triangles| GlbNode { name, triangles, extras: extras.clone() };
        let nodes = [node("chair 1", &[0, 1][..]), node("none", &[]), node("chair 2", &[7])];
        let glb = write_glb_nodes(&mesh, &nodes).unwrap();
        let json = core::str::from_utf8(chunk(&glb, 12, b"JSON")).unwrap();
        let json: serde_json::Value = serde_json::from_str(json).unwrap();
        assert_eq!(json["scenes"][0]["nodes"], serde_json::json!([0, 1, 2]));
        assert_eq!(json["nodes"][0]["name"], "chair 1");
        assert_eq!(json["nodes"][0]["mesh"], 0);
        assert!(json["nodes"][1]["mesh"].is_null());
        assert_eq!(json["nodes"][2]["mesh"], 1);
        let expected = serde_json::json!({"id": 3, "class": "a \"chair\"", "structure": false});
        assert_eq!(json["nodes"][2]["extras"], expected);
        assert_eq!(json["meshes"].as_array().unwrap().len(), 2);
        assert_eq!(json["materials"].as_array().unwrap().len(), 1);
        let attributes = &json["meshes"][1]["primitives"][0]["attributes"];
        let position = attributes["POSITION"].as_u64().unwrap() as usize;
        assert_eq!(json["accessors"][position]["count"], 3);
        assert!(attributes["COLOR_0"].is_u64());
        let mut bad = nodes.clone();
        bad[0].triangles = &[8];
        assert!(write_glb_nodes(&mesh, &bad).is_err());
        bad[0] = GlbNode { extras: vec![("x", GlbExtra::Number(f64::NAN))], ..node("a", &[0]) };
        assert!(write_glb_nodes(&mesh, &bad).is_err());
        assert!(write_glb_nodes(&mesh, &[]).is_ok());
    }

    #[test]
    fn empty_and_bad_meshes() {
        let glb = write_glb(&Mesh::default()).unwrap();
        assert_eq!(glb.len(), 20 + chunk(&glb, 12, b"JSON").len());
        let mut m = colored();
        m.positions[0][1] = f32::NAN;
        assert!(write_glb(&m).is_err());
    }
}
