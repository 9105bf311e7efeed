//! Sound glTF files by a seeded generator: hierarchies, modes, index types, interleaved and quantized vertices, copies.

use std::fmt::Write as _;

/// Numbers that decide about a file; the same numbers make the same file.
pub struct Choices<'a> {
    next: &'a mut dyn FnMut() -> u64,
}

impl<'a> Choices<'a> {
    pub fn new(next: &'a mut dyn FnMut() -> u64) -> Self {
        Self { next }
    }

    fn below(&mut self, count: usize) -> usize {
        ((self.next)() % count as u64) as usize
    }

    /// A number from -4 to 4 in steps of 1/8, so that decimal text holds it exactly.
    fn number(&mut self) -> f32 {
        self.below(65) as f32 / 8.0 - 4.0
    }
}

/// The text of a file whose buffer is a `data:` URI.
pub fn generate(choices: &mut Choices) -> String {
    let (mut bytes, mut views, mut accessors, mut meshes) = (Vec::<u8>::new(), Vec::new(), Vec::new(), Vec::new());
    for _ in 0..1 + choices.below(3) {
        let mut primitives = Vec::new();
        for _ in 0..1 + choices.below(3) {
            let (vertices, mode) = (3 + choices.below(12), 4 + choices.below(3));
            let stride = if choices.below(2) == 0 { 12 } else { 12 + 4 * (1 + choices.below(3)) };
            let (mut least, mut most) = ([f32::MAX; 3], [f32::MIN; 3]);
            let start = bytes.len();
            for _ in 0..vertices {
                let end = bytes.len() + stride;
                for axis in 0..3 {
                    let number = choices.number();
                    least[axis] = least[axis].min(number);
                    most[axis] = most[axis].max(number);
                    bytes.extend(number.to_le_bytes());
                }
                bytes.resize(end, 0xAA);
            }
            views.push(format!(
                r#"{{"buffer":0,"byteOffset":{start},"byteLength":{},"byteStride":{stride}}}"#,
                bytes.len() - start
            ));
            accessors.push(format!(
                r#"{{"bufferView":{},"componentType":5126,"count":{vertices},"type":"VEC3","min":{least:?},"max":{most:?}}}"#,
                views.len() - 1
            ));
            let mut primitive = format!(r#"{{"attributes":{{"POSITION":{}}},"mode":{mode}"#, accessors.len() - 1);
            if choices.below(3) > 0 {
                let size = [1, 2, 4][choices.below(3)];
                let count = if mode == 4 { 3 * (1 + choices.below(8)) } else { 3 + choices.below(12) };
                let start = bytes.len();
                for _ in 0..count {
                    let index = choices.below(vertices) as u32;
                    bytes.extend(&index.to_le_bytes()[..size]);
                }
                views.push(format!(r#"{{"buffer":0,"byteOffset":{start},"byteLength":{}}}"#, count * size));
                bytes.resize(bytes.len().next_multiple_of(4), 0);
                let kind = [5121, 5123, 0, 5125][size - 1];
                accessors.push(format!(
                    r#"{{"bufferView":{},"componentType":{kind},"count":{count},"type":"SCALAR"}}"#,
                    views.len() - 1
                ));
                write!(primitive, r#","indices":{}"#, accessors.len() - 1).unwrap();
            }
            primitives.push(primitive + "}");
        }
        meshes.push(format!(r#"{{"primitives":[{}]}}"#, primitives.join(",")));
    }
    // Each node is the child of an earlier one or a root.
    let count = 1 + choices.below(8);
    let parents: Vec<Option<usize>> =
        (0..count).map(|node| (node > 0 && choices.below(3) > 0).then(|| choices.below(node))).collect();
    let list = |wanted: Option<usize>| -> String {
        let children = (0..count).filter(|&node| parents[node] == wanted).map(|node| node.to_string());
        children.collect::<Vec<_>>().join(",")
    };
    let nodes: Vec<String> = (0..count)
        .map(|node| {
            let mut fields = vec![format!(r#""name":"n{node}""#)];
            if node == 0 || choices.below(3) > 0 {
                fields.push(format!(r#""mesh":{}"#, choices.below(meshes.len())));
            }
            if parents.contains(&Some(node)) {
                fields.push(format!(r#""children":[{}]"#, list(Some(node))));
            }
            let mut triple = || [choices.number(), choices.number(), choices.number()];
            let (a, b, c, t) = (triple(), triple(), triple(), triple());
            match choices.below(3) {
                0 => {}
                1 => fields.push(format!(
                    r#""matrix":[{},{},{},0,{},{},{},0,{},{},{},0,{},{},{},1]"#,
                    a[0], a[1], a[2], b[0], b[1], b[2], c[0], c[1], c[2], t[0], t[1], t[2]
                )),
                _ => {
                    let rotation = ["[0,0,0,1]", "[1,0,0,0]", "[0.6,0,0,0.8]", "[0,0.8,0,-0.6]", "[0.5,-0.5,0.5,0.5]"];
                    let rotation = rotation[choices.below(rotation.len())];
                    fields.push(format!(r#""translation":{t:?},"rotation":{rotation},"scale":{a:?}"#));
                }
            }
            format!("{{{}}}", fields.join(","))
        })
        .collect();
    let hex: String = bytes.iter().map(|byte| format!("%{byte:02x}")).collect();
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{}]}}],"nodes":[{}],"meshes":[{}],"accessors":[{}],"bufferViews":[{}],"buffers":[{{"byteLength":{},"uri":"data:application/octet-stream,{hex}"}}]}}"#,
        list(None),
        nodes.join(","),
        meshes.join(","),
        accessors.join(","),
        views.join(","),
        bytes.len()
    )
}
