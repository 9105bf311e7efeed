//! Damaged files by the thousand, the same in every run: sound files of each format, changed by a seeded mutator, through
//! the entry points that the fuzz targets use. Inputs that once failed are listed at the end.

use crate::entry_points;
use crate::random::Random;
use crate::sound_gltf;
use bvhscope::scene::LoadOptions;
use bvhscope_engine::Triangle;
use bvhscope_engine::cancel::CancelToken;
use bvhscope_engine::settings::{BuildSettings, Pass, Passes, Preset};
use bvhscope_engine::tree::ContainerKind;
use bvhscope_engine::tree_file::{Header, Instance, TwoLevelTrees, write_tree, write_two_levels};

/// Numbers at which sums and products overflow.
const NUMBERS: [&str; 16] = [
    "0",
    "-1",
    "1",
    "2147483648",
    "4294967295",
    "4294967296",
    "18446744073709551615",
    "-9223372036854775808",
    "nan",
    "inf",
    "-inf",
    "1e999",
    "1e-50",
    "0x10",
    "1,5",
    "999999999999999999999999",
];

/// One to six changes: bits, cuts, splices, numbers.
fn mutate(seed: &[u8], other: &[u8], random: &mut Random) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..1 + random.below(6) {
        let at = random.below(bytes.len().max(1)).min(bytes.len());
        match random.below(8) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << random.below(8),
            1 if !bytes.is_empty() => bytes[at] = random.next() as u8,
            2 if random.below(8) == 0 => bytes.truncate(at),
            3 => {
                let end = (at + random.below(24)).min(bytes.len());
                bytes.drain(at..end);
            }
            4 => {
                let from = random.below(other.len());
                let end = (from + random.below(40)).min(other.len());
                bytes.splice(at..at, other[from..end].iter().copied());
            }
            5 => {
                let word = [0, u32::MAX, 1 << 31, 0x7FC0_0000, 0x7F80_0000][random.below(5)].to_le_bytes();
                let end = (at + 4).min(bytes.len());
                bytes.splice(at..end, word);
            }
            _ => replace_number(&mut bytes, random),
        }
    }
    bytes
}

/// Replaces a number in the text by another.
fn replace_number(bytes: &mut Vec<u8>, random: &mut Random) {
    let digit = |byte: &u8| byte.is_ascii_digit() || matches!(byte, b'.' | b'-');
    let start = random.below(bytes.len().max(1)).min(bytes.len());
    let Some(from) = bytes[start..].iter().position(digit).map(|offset| start + offset) else { return };
    let end = bytes[from..].iter().position(|byte| !digit(byte)).map_or(bytes.len(), |offset| from + offset);
    bytes.splice(from..end, NUMBERS[random.below(NUMBERS.len())].bytes());
}

/// Factor on the number of mutations, from the environment variable BVHSCOPE_MUTATIONS: for a night of testing.
fn effort() -> usize {
    std::env::var("BVHSCOPE_MUTATIONS").ok().and_then(|text| text.parse().ok()).unwrap_or(1)
}

fn attack(seeds: &[Vec<u8>], count: usize, target: impl Fn(&[u8])) {
    let mut random = Random(0x5EED);
    let count = count * effort();
    for (index, seed) in seeds.iter().enumerate() {
        target(seed);
        // Truncated at every byte.
        for length in 0..seed.len().min(2000) {
            target(&seed[..length]);
        }
        for _ in 0..count {
            let other = &seeds[(index + random.below(seeds.len())) % seeds.len()];
            target(&mutate(seed, other, &mut random));
        }
    }
}

fn bytes(text: &str) -> Vec<u8> {
    text.as_bytes().to_vec()
}

fn le(numbers: &[f32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

/// Whether a truncated file loads without a warning.
fn is_silent(name: &str, bytes: &[u8]) -> bool {
    let path = std::path::Path::new("/nonexistent-folder-of-hostile-models").join(name);
    let scene = bvhscope::scene::load_bytes(&path, bytes, &LoadOptions::default(), &CancelToken::new());
    scene.is_ok_and(|scene| scene.warnings.is_empty())
}

/// Files that declare their length or their end give an error or a warning wherever they are truncated. A list of lines cannot:
/// truncated between two lines, or within its last number, it is a shorter list.
#[test]
fn truncated_files_are_reported() {
    let [ply, little, big] = ply_seeds();
    let [stl, binary] = stl_seeds();
    // One solid, because a file truncated after the first of two is complete.
    let second = stl.windows(6).position(|word| word == b"SOLID\n").expect("there are two");
    let stl = stl[second..].to_vec();
    let [gltf, glb] = gltf_seeds();
    let [boxes, spheres, polytopes, oriented] = tree_file_seeds();
    let two_levels = two_level_seed();
    for (name, bytes) in [
        ("a.bvh", boxes),
        ("a.bvh", spheres),
        ("a.bvh", polytopes),
        ("a.bvh", oriented),
        ("a.bvh", two_levels),
        ("a.ply", ply),
        ("a.ply", little),
        ("a.ply", big),
        ("a.stl", stl),
        ("b.stl", binary),
        ("a.gltf", gltf),
        ("a.glb", glb),
    ] {
        assert!(
            bvhscope::scene::load_bytes(
                std::path::Path::new(name),
                &bytes,
                &LoadOptions::default(),
                &CancelToken::new()
            )
            .is_ok(),
            "{name}"
        );
        let end = bytes.trim_ascii_end().len();
        let silent: Vec<usize> = (0..end).filter(|&length| is_silent(name, &bytes[..length])).collect();
        assert!(silent.is_empty(), "{name} of {end} bytes, cut at {silent:?}");
    }
}

#[test]
fn damaged_obj_files() {
    let seeds = [
        bytes(
            "# a\nmtllib a.mtl\no one\nv 0 0 0\nv 1 0 0 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvn 0 0 1\nusemtl red\n\
               f 1/1/1 2/2/1 3//1 4\ng two\ns off\nf -4 -3 -2\nl 1 2\nf 1 2 \\\n3\n",
        ),
        bytes(
            "v 0 0 0 1\nv 1 0 0 255 0 0 0.5\nv 0 1 0 2 3\nvt nan\nvt 0 1 2 3\nvn 0 0 0\nvn inf 0 1 2\nf 1/2/1 2/1/-1 3/9/9\n\
               f 1/ 2// +3/1/1/1\nf 1//1 2/1 3 1 2 3\nf 4294967297 1.0 -9223372036854775808\nsurf 0 1 0 1 1/1/1\ncurv 0 1 1 2\n\
               mtllib a.mtl b c\nusemtl\nusemtl b c\nwhat 1 \\\n\\\np 1 2 3 # 4\nf 1 2 3 # 4\n",
        ),
        bytes("\u{feff}v 0 0 0\r\nv 1e3 0 0\r\nv 0 1e-3 0\r\nf 1/ 2/ 3/\r\nusemtl\tb\r\nf 3 2 1\r\n"),
    ];
    attack(&seeds, 3000, entry_points::obj);
}

#[test]
fn damaged_material_libraries() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let seeds = [
        bytes(
            "newmtl a\nKd 0.5 0.5 0.5\nKe 1 1 1\nmap_Kd -s 1 1 1 -o 0 0 -clamp on a.mtl\nnewmtl b\nKd 0.5\nmap_d ../x.png\nd 0.3\nillum 2\n",
        ),
        bytes(
            "\u{feff}Kd 1 0 0\r\nnewmtl b\rKd 1 2\nKe nan\nTr 0.5\nd -halo 0\nmap_Kd -mm 0 -s 2 -t x\nmap_d a.mtl\nnewmtl b\nmap_Ke a\ndisp a\nwhat # 1\n",
        ),
    ];
    attack(&seeds, 1500, |bytes| entry_points::mtl(folder.path(), bytes));
}

/// A text and a binary file.
fn gltf_seeds() -> [Vec<u8>; 2] {
    let json = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0,1]}],"nodes":[{"mesh":0,"scale":[1,-1,2]},
        {"children":[2],"rotation":[0,0,0,1]},{"mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]}],
        "meshes":[{"primitives":[{"attributes":{"POSITION":0,"NORMAL":0,"TEXCOORD_0":2,"COLOR_0":0},"indices":1,"material":0,"mode":4}]}],
        "materials":[{"pbrMetallicRoughness":{"baseColorFactor":[1,0.5,0,1],"baseColorTexture":{"index":0}},"emissiveFactor":[1,1,1],"alphaMode":"MASK"}],
        "textures":[{"source":0,"sampler":0}],"samplers":[{"wrapS":33071}],"images":[{"bufferView":1}],
        "accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","sparse":{"count":1,"indices":{"bufferView":1,"componentType":5121},"values":{"bufferView":0}}},
        {"bufferView":1,"componentType":5121,"count":3,"type":"SCALAR"},{"bufferView":0,"componentType":5121,"normalized":true,"count":3,"type":"VEC2"}],
        "bufferViews":[{"buffer":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":3}],
        "buffers":[{"byteLength":39%URI%}]}"#;
    let mut data = le(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    data.extend([0, 1, 2]);
    let hex: String = data.iter().map(|byte| format!("%{byte:02x}")).collect();
    let text = json.replace("%URI%", &format!(",\"uri\":\"data:,{hex}\""));
    let mut chunk = json.replace("%URI%", "").into_bytes();
    chunk.resize(chunk.len().next_multiple_of(4), b' ');
    let mut glb = b"glTF\x02\0\0\0".to_vec();
    glb.extend((12 + 8 + chunk.len() as u32 + 8 + 40).to_le_bytes());
    glb.extend((chunk.len() as u32).to_le_bytes());
    glb.extend(b"JSON");
    glb.extend(&chunk);
    glb.extend(40_u32.to_le_bytes());
    glb.extend(b"BIN\0");
    data.push(0);
    glb.extend(&data);
    [text.into_bytes(), glb]
}

/// Numbers in every notation, copies, a strip, scenes, versions, and what no scene here holds.
const GLTF_EXTRAS: &str = r#"{"asset":{"version":"2.1","minVersion":"2.0"},"scene":1.0,"scenes":[{},{"nodes":[0]}],"cameras":[{}],
    "animations":[{}],"extensions":{"KHR_lights_punctual":{"lights":[{}]}},
    "nodes":[{"mesh":0,"skin":0,"children":[4294967296],"extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":0,"SCALE":0}}}}],
    "meshes":[{"primitives":[{"attributes":{"POSITION":0,"COLOR_0":0,"TEXCOORD_1":0},"mode":5,"material":0,"targets":[{}]},
    {"attributes":{"POSITION":0},"indices":1,"mode":6,"extensions":{"KHR_draco_mesh_compression":{}}}]}],
    "materials":[{"alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorTexture":{"index":0,"texCoord":1,"extensions":
    {"KHR_texture_transform":{"rotation":1e0,"scale":[2,2],"offset":[0,0.5]}}}}}],
    "textures":[{"extensions":{"KHR_texture_basisu":{"source":0}},"sampler":9}],"images":[{"uri":"a%20b.png"}],
    "accessors":[{"componentType":5.126e3,"count":5.0,"type":"VEC3"},{"componentType":5121,"count":4,"type":"SCALAR"}]}"#;

#[test]
fn damaged_gltf_files() {
    let mut seeds = gltf_seeds().to_vec();
    seeds.push(bytes(GLTF_EXTRAS));
    let mut random = Random(0x617F);
    seeds.push(sound_gltf::generate(&mut sound_gltf::Choices::new(&mut || random.next())).into_bytes());
    attack(&seeds, 2000, entry_points::gltf);
}

/// A text and binary files of both byte orders.
fn ply_seeds() -> [Vec<u8>; 3] {
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\ncomment c\nelement vertex 4\nproperty float x\nproperty double y\nproperty float z\n\
             property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 2\n\
             property list uchar int vertex_indices\nelement extra 1\nproperty list ushort short s\nend_header\n"
        )
    };
    let mut text = header("ascii");
    text += "0 0 0 255 0 0\n1 0 0 255 0 0\n1 1 0 0 0 0\n0 1 0 0 0 0\n4 0 1 2 3\n3 0 1 2\n2 -1 5\n";
    let binary = |big: bool| {
        let mut bytes = bytes(&header(if big { "binary_big_endian" } else { "binary_little_endian" }));
        macro_rules! put {
            ($value:expr) => {
                bytes.extend(if big { $value.to_be_bytes().to_vec() } else { $value.to_le_bytes().to_vec() })
            };
        }
        for (x, y) in [(0.0_f32, 0.0_f64), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)] {
            put!(x);
            put!(y);
            put!(0.0_f32);
            bytes.extend([255, 0, 9]);
        }
        bytes.push(4);
        [0_i32, 1, 2, 3].into_iter().for_each(|index| put!(index));
        bytes.push(3);
        [0_i32, 1, 2].into_iter().for_each(|index| put!(index));
        put!(2_u16);
        put!(7_i16);
        put!(8_i16);
        bytes
    };
    [text.into_bytes(), binary(false), binary(true)]
}

#[test]
fn damaged_ply_files() {
    attack(&ply_seeds(), 3000, entry_points::ply);
    // Strips, wide indices, a comment with a texture, unknown elements and properties, old line ends.
    let strips = "ply\nformat ascii 1.0\ncomment TextureFile a.png\nelement vertex 4\nproperty double x\nproperty int y\n\
                  property short z\nproperty float nx\nproperty ushort alpha\nelement tristrips 1\n\
                  property list uint uint vertex_index\nelement edge 1\nproperty list uchar double ends\nend_header\n\
                  0 0 0 1 9\n1 0 0 1 9\n0 1 0 1 9\n1 1 0 1 9\n8 0 1 2 3 4294967295 1 2.5 3\n2 0 1e300\n";
    let mut old = bytes(&strips.replace('\n', "\r").replace("ascii", "binary_big_endian"));
    old.extend([0; 60]);
    attack(&[bytes(strips), old], 1500, entry_points::ply);
}

/// A text and a binary file.
fn stl_seeds() -> [Vec<u8>; 2] {
    let text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n\
                SOLID\nFACET NORMAL 0 0 0\nOUTER LOOP\nVERTEX 0 0 1\nVERTEX 1 0 .5\nVERTEX 0 1 1e3\nENDLOOP\nENDFACET\nENDSOLID\n";
    let mut binary = b"header".to_vec();
    binary.resize(80, 0);
    binary.extend(2_u32.to_le_bytes());
    for z in [0.0, 1.0] {
        binary.extend(le(&[0.0, 0.0, 1.0, 0.0, 0.0, z, 1.0, 0.0, z, 0.0, 1.0, z]));
        binary.extend([0, 0]);
    }
    [bytes(text), binary]
}

#[test]
fn damaged_stl_files() {
    attack(&stl_seeds(), 3000, entry_points::stl);
    // Facets outside solids and without an end, other statements; colours, a false count, bytes left over.
    let open = "facet normal 0 0 1\nvertex 0 0 0\nvertex 1 0 0 7\nvertex 0 1 0\nfacet\nendfacet\ncolor 1 0 0\nsolid b\nendloop\n";
    let mut colored = b"COLOR=abcd".to_vec();
    colored.resize(80, 0);
    colored.extend(0_u32.to_le_bytes());
    colored.extend([63; 103]);
    attack(&[bytes(open), colored], 1500, entry_points::stl);
}

#[test]
fn damaged_pbrt_files() {
    let scene = "# a\nScale -1 1 1\nLookAt 0 0 5 0 0 0 0 1 0\nCamera \"perspective\" \"float fov\" [60]\n\
                 Film \"rgb\" \"integer xresolution\" 20\nWorldBegin\nMaterial \"conductor\" \"float roughness\" 0.1\n\
                 Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2] \"normal N\" [0 0 1 0 0 1 0 0 1]\n\
                 AttributeBegin\nRotate 30 0 0 1\nShape \"sphere\" \"float radius\" 2 \"float phimax\" [90]\nAttributeEnd\n";
    let objects = "ObjectBegin \"a\"\nConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1]\nShape \"disk\"\nObjectEnd\n\
                   ObjectInstance \"a\" CoordinateSystem \"b\" CoordSysTransform \"b\" ReverseOrientation\n\
                   Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"a.png\"\n\
                   MakeNamedMaterial \"m\" \"string type\" [\"diffuse\"] \"texture reflectance\" \"t\"\nNamedMaterial \"m\"\n\
                   AreaLightSource \"diffuse\" \"rgb L\" [1 2 3]\nInclude \"a.pbrt\"\nImport \"b.pbrt\"\nTransformBegin\n\
                   Shape \"bilinearmesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 1 1 1] \"bool x\" true\nTransformEnd\n\
                   Shape \"plymesh\" \"string filename\" \"a.ply\"\nShape \"loopsubdiv\" \"integer levels\" 3\nLightSource \"point\"\n";
    attack(&[bytes(scene), bytes(objects)], 2500, entry_points::pbrt);
}

/// Tree files of each kind of container with their triangles: a binary tree of boxes, and the wide trees of the others.
fn tree_file_seeds() -> [Vec<u8>; 4] {
    let token = CancelToken::new();
    let mut random = Random(5);
    let triangles: Vec<Triangle> = (0..12)
        .map(|_| [(); 3].map(|()| glam::Vec3::new(random.signed(), random.signed(), random.signed())))
        .map(|[a, b, c]| Triangle { a, b, c })
        .collect();
    ContainerKind::WITH_ORIENTED.map(|kind| {
        let (container, optimize) = match kind {
            ContainerKind::Oriented => (ContainerKind::Aabb, Passes::NONE.with(Pass::Orient)),
            other => (other, Passes::NONE),
        };
        let settings = BuildSettings { optimize, ..BuildSettings::preset(Preset::Hq, container) };
        let bvh = bvhscope_engine::build(&triangles, &settings, &token).unwrap();
        let wide = bvh.wide().tree.to_tree(bvh.tree(), &token).unwrap().unwrap();
        let tree = if kind == ContainerKind::Aabb { bvh.tree() } else { &wide };
        let mut bytes = Vec::new();
        write_tree(tree, &Header::new(triangles.len()), Some(&triangles), &mut bytes, &token).unwrap();
        bytes
    })
}

/// A tree file in two levels, of two meshes and three instances, with triangles and numbers.
fn two_level_seed() -> Vec<u8> {
    let (token, mut random, mut bytes) = (CancelToken::new(), Random(6), Vec::new());
    let mut point = || glam::Vec3::new(random.signed(), random.signed(), random.signed());
    let mut mesh = |count: usize| -> Vec<Triangle> {
        (0..count).map(|_| [(); 3].map(|()| point())).map(|[a, b, c]| Triangle { a, b, c }).collect()
    };
    let (meshes, stand_ins) = ([mesh(5), mesh(1)], mesh(3));
    let settings = BuildSettings::default();
    let build = |triangles: &Vec<Triangle>| bvhscope_engine::build(triangles, &settings, &token).unwrap();
    let (trees, top) = (meshes.each_ref().map(build), build(&stand_ins));
    let at = |x: f32| [[0.5, 0.0, 0.0, x], [0.0, 0.0, -2.0, 0.0], [0.0, 1.0, 0.25, 3.0]];
    let trees = TwoLevelTrees {
        meshes: trees.iter().map(bvhscope_engine::Bvh::tree).zip(meshes.iter().map(Vec::as_slice)).collect(),
        top: top.tree(),
        instances: [0, 1, 0]
            .into_iter()
            .zip([0.0, 2.0, -4.0])
            .map(|(mesh, x)| Instance { mesh, matrix: at(x) })
            .collect(),
        ids: Some(&[3, 5, 8]),
    };
    write_two_levels(&trees, &Header::new(0), true, &mut bytes, &token).unwrap();
    bytes
}

/// A ray file with all arrays, arrays of NumPy of both precisions, and lines.
fn ray_file_seeds() -> [Vec<u8>; 4] {
    let mut native = bytes(
        "bvhscope rays 1\n{\"rays\":2,\"name\":\"a\",\"offset\":[1,0,0],\"arrays\":{\"rays\":0,\"any\":64,\
         \"expected_triangle\":66,\"expected_t\":74,\"weight\":82,\"pixel\":90}}\n",
    );
    let rays = [0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, f32::INFINITY, 1.0, 2.0, 3.0, 0.5, 0.0, 0.0, -2.0, 9.0];
    native.extend(le(&rays));
    native.extend([0, 1]);
    native.extend([7_u32, u32::MAX].map(u32::to_le_bytes).as_flattened());
    native.extend(le(&[1.5, f32::INFINITY, 1.0, 2.5]));
    native.extend([3_u32, 4, 5, 6].map(u32::to_le_bytes).as_flattened());
    let npy = |dtype: &str, columns: usize, data: Vec<u8>| {
        let header = format!("{{'descr': '{dtype}', 'fortran_order': False, 'shape': (2, {columns}), }}\n");
        let mut file = b"\x93NUMPY\x01\0".to_vec();
        file.extend((header.len() as u16).to_le_bytes());
        file.extend(header.bytes());
        file.extend(data);
        file
    };
    let double = rays[..12].iter().flat_map(|&number| f64::from(number).to_le_bytes()).collect();
    let text = bytes("# rays\n0 0 0 1 0 0\n\n1,2,3,0.5,0,0,-2,9\r\n1e300 0 0 0 0 1\n0 0 0 nan inf -inf");
    [native, npy("<f4", 8, le(&rays)), npy("<f8", 6, double), text]
}

#[test]
fn damaged_ray_files() {
    attack(&ray_file_seeds(), 3000, entry_points::ray_file);
}

#[test]
fn damaged_tree_files() {
    attack(&tree_file_seeds(), 6000, entry_points::tree_file);
    attack(&[two_level_seed()], 3000, entry_points::tree_file);
}

/// Floats of every kind: ordinary, equal, huge, tiny, denormal, any bits.
fn floats(random: &mut Random, count: usize) -> Vec<u8> {
    let style = random.below(7);
    let number = |random: &mut Random| match style {
        0 => random.signed(),
        1 => random.signed() * 1e17,
        2 => random.signed() * 1e-40,
        3 => (random.below(3) as f32) - 1.0,
        4 => f32::from_bits(random.next() as u32),
        5 => random.signed() * (random.below(120) as f32 - 60.0).exp2(),
        _ => 1.0,
    };
    le(&(0..count)
        .map(|_| if random.below(40) == 0 { f32::from_bits(random.next() as u32) } else { number(random) })
        .collect::<Vec<_>>())
}

#[test]
fn trees_of_arbitrary_floats() {
    let mut random = Random(0xF10A7);
    for round in 0..400 * effort() {
        let count = [9, 90, 900, 3000][round % 4] + random.below(9);
        let mut bytes = vec![random.next() as u8];
        bytes.extend(floats(&mut random, count));
        bytes.extend(vec![0; random.below(3)]);
        entry_points::builder(&bytes);
    }
}

#[test]
fn arbitrary_rays_through_arbitrary_trees() {
    let mut random = Random(0xA11);
    for _ in 0..1500 * effort() {
        let mut bytes = vec![random.next() as u8];
        bytes.extend(floats(&mut random, 24 * 9));
        bytes.extend(floats(&mut random, 60));
        bytes.extend(vec![0; random.below(3)]);
        entry_points::traversal(&bytes);
    }
}

/// Inputs of [`entry_points::traversal`] that fuzzing found. Rays missed a sphere whose squared radius is denormal, and a small
/// sphere where the direction was so long that half the chord, in multiples of it, vanished.
const FOUND_IN_TRAVERSAL: [&str; 2] = [
    concat!(
        "410005990a0a0f4f1ea3a30a1226029b0202029b029b029b9b02020202000000000000000202020b02020202020202020202",
        "02020202020202020202ffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff",
        "ffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff02029b",
        "9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b020202020202020202",
        "020202020202020202020202020202020202022ede8b27a3a327",
    ),
    concat!(
        "410005990a0a0f4f1ea3a30a1226020202020202020202020202b90202900000000000000002020202020202020202020202",
        "0202020202029b16000000000000009b9b9b9b9b00000000000000a2a2a200000000000400000000000000002c2c2c2c2c2c",
        "2c2c2c2c00000000000000000000000000000000000000000000009b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b0100",
        "00119b9b9b9b9b00000000000000000000000000000000000000000000009b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b",
        "9b959b9b9b9b9b02020202029b9b9b9b9b9b9b9b9b0000000000000000000000000000000000000000000000000000000000",
        "003a000000000000000000000000a2a2a2000000000004000000000000000000000000000000000000000000000000000000",
        "000000009b9bba9b9b9babaaaaaaaaaaaa0a00000000000000000000000000000000000000000000a2a2a200000000000400",
        "0000000000000000000000000000000000000000000000000000000000000000000000009b9b9b9b9b9b9b9b9b9b9b9b9b9b",
        "9b0114ab9b9b9b9b9b959b9b9b9b9b02020202029b9b9b9b9b9b9b3636363636363636363636368036363600000000000000",
        "00000000000000000000000000000000000000000000a2a2a200000000000400000000000000002c2c2c2c2c2c2c2c2c2c00",
        "000000000000000000000000000000000000000000009b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b959b9b7a9b9b9b",
        "02020202020202020202020202020202020202020202020202020202022eda8b27a3a3270000000000000000000000000000",
        "00000000000000000000000000009b9bba9b9b9b9b9b00000000000000000000000000000000000000000000000000000000",
        "a2a2a2000000000004000000000000000000000000000000000000000000000000000000000000000000000000009b9b9b9b",
        "9b9b9b9b9b9b9b9b9b9b9bab9b9b9b9b9b959b9b9b9b9b02020202029b9b9b9b9b9b9b333333333333333333333333803636",
        "360000000000000000000000000000000000000000000000000000000000a2a2a200000000000400000000000000002c2c2c",
        "2c2c2c2c2c2c2c00000000000000000000000000000000000000000000009b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b9b",
        "9b959b9b7a9b9b9b02020202020202020202020202020202020202020202020202020202022eda8b27a3a327",
    ),
];

#[test]
fn traversal_bugs_found_by_fuzzing_stay_fixed() {
    for found in FOUND_IN_TRAVERSAL {
        let bytes: Vec<u8> = (0..found.len())
            .step_by(2)
            .map(|at| u8::from_str_radix(&found[at..at + 2], 16).expect("hexadecimal digits"))
            .collect();
        entry_points::traversal(&bytes);
    }
}
