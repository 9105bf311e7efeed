//! PBRT scenes: values worked out by hand, what is counted, and broken files.

use std::path::Path;

use bvhscope::camera::Projection;
use bvhscope::scene::{Instancing, LoadError, LoadOptions, Scene, load_bytes};
use bvhscope::view::CameraChoice;
use bvhscope_engine::cancel::CancelToken;
use glam::Vec3;

use crate::formats::load_path;
use crate::packed::packed;

/// A triangle in the plane z = 0.
const TRIANGLE: &str = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 2]\n";

fn load(text: &str) -> Result<Scene, LoadError> {
    load_bytes(Path::new("a.pbrt"), text.as_bytes(), &LoadOptions::default(), &CancelToken::new())
}

/// The corners of the triangles of a sound scene, rounded to thousandths.
fn corners(text: &str) -> Vec<[[f32; 3]; 3]> {
    let scene = load(text).unwrap();
    assert!(scene.warnings.is_empty(), "{text}: {:?}", scene.warnings);
    let rounded = |point: Vec3| ((point * 1000.0).round() / 1000.0 + 0.0).to_array();
    scene.triangles.iter().map(|triangle| [triangle.a, triangle.b, triangle.c].map(rounded)).collect()
}

#[test]
fn transforms_are_applied_from_the_last_to_the_first() {
    let moved = [[5.0, 6.0, 7.0], [6.0, 6.0, 7.0], [5.0, 7.0, 7.0]];
    for (before, expected) in [
        // Turned by 90° around z, doubled, moved along x.
        ("Translate 1 0 0 Scale 2 2 2 Rotate 90 0 0 1", [[1.0, 0.0, 0.0], [1.0, 2.0, 0.0], [-1.0, 0.0, 0.0]]),
        ("Scale 9 9 9 Transform [1 0 0 0 0 1 0 0 0 0 1 0 5 6 7 1]", moved),
        ("Translate 5 0 0 ConcatTransform [1 0 0 0 0 1 0 0 0 0 1 0 0 6 7 1]", moved),
        ("Translate 5 6 7 CoordinateSystem \"here\" Identity Scale 2 2 2 CoordSysTransform \"here\"", moved),
        ("Translate 5 6 7 AttributeBegin Scale 3 3 3 AttributeEnd", moved),
        ("Translate 5 6 7 TransformBegin Scale 3 3 3 TransformEnd", moved),
        ("Scale 4 4 4 WorldBegin Translate 5 6 7", moved),
        // The left-handed camera at (0, 0, -2) looks along z: nothing but a move.
        ("LookAt 0 0 -2 0 0 1 0 1 0", [[0.0, 0.0, 2.0], [1.0, 0.0, 2.0], [0.0, 1.0, 2.0]]),
        // Seen from x, with z to the right.
        ("LookAt 2 0 0 0 0 0 0 1 0", [[0.0, 0.0, 2.0], [0.0, 0.0, 1.0], [0.0, 1.0, 2.0]]),
        // The front stays in front: a mirror swaps two corners, and so does turning the shape inside out.
        ("Scale -1 1 1", [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]]),
        ("ReverseOrientation", [[0.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]),
        ("ReverseOrientation ReverseOrientation", [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]),
    ] {
        assert_eq!(corners(&format!("{before}\n{TRIANGLE}")), [expected], "{before}");
    }
}

#[test]
fn objects_are_copied_with_the_transforms_of_both_places() {
    let scene = format!(
        "AttributeBegin Translate 1 0 0 ObjectBegin \"a\" Scale 2 2 2\n{TRIANGLE}ObjectEnd AttributeEnd\n\
         Translate 0 0 5 ObjectInstance \"a\" Scale -1 1 1 ObjectInstance \"a\"\n{TRIANGLE}"
    );
    let expected = [
        [[1.0, 0.0, 5.0], [3.0, 0.0, 5.0], [1.0, 2.0, 5.0]],
        [[-1.0, 0.0, 5.0], [-1.0, 2.0, 5.0], [-3.0, 0.0, 5.0]],
        [[0.0, 0.0, 5.0], [0.0, 1.0, 5.0], [-1.0, 0.0, 5.0]],
    ];
    assert_eq!(corners(&scene), expected);
}

#[test]
fn every_kind_of_shape_has_its_size() {
    let area = |shape: &str| {
        let scene = load(&format!("# a comment\nShape {shape}\n")).unwrap();
        let sum: f32 = scene.triangles.iter().map(|triangle| triangle.scaled_normal().length() * 0.5).sum();
        (sum, scene.bounds)
    };
    let pi = std::f32::consts::PI;
    // Curved ones are inscribed: a little smaller.
    for (shape, expected, low, high) in [
        ("\"sphere\" \"float radius\" 2", 16.0 * pi, [-2.0; 3], [2.0; 3]),
        ("\"sphere\" \"float zmin\" [0]", 2.0 * pi, [-1.0, -1.0, 0.0], [1.0; 3]),
        ("\"sphere\" \"float phimax\" [180]", 2.0 * pi, [-1.0, 0.0, -1.0], [1.0; 3]),
        ("\"disk\" \"float height\" 3 \"float innerradius\" [0.5]", 0.75 * pi, [-1.0, -1.0, 3.0], [1.0, 1.0, 3.0]),
        ("\"cylinder\" \"float radius\" 2 \"float zmax\" 4", 20.0 * pi, [-2.0, -2.0, -1.0], [2.0, 2.0, 4.0]),
        ("\"bilinearmesh\" \"point3 P\" [0 0 0 2 0 0 0 1 0 2 1 0]", 2.0, [0.0; 3], [2.0, 1.0, 0.0]),
        ("\"trianglemesh\" \"point P\" [0 0 0 2 0 0 0 1 0]", 1.0, [0.0; 3], [2.0, 1.0, 0.0]),
    ] {
        let (found, bounds) = area(shape);
        assert!((0.975..1.0001).contains(&(found / expected)), "{shape}: {found} instead of {expected}");
        let error = (bounds.min - Vec3::from(low)).abs().max((bounds.max - Vec3::from(high)).abs());
        assert!(error.max_element() < 1e-6, "{shape}: {bounds:?}");
    }
}

#[test]
fn normals_and_texture_coordinates_are_kept() {
    let mesh = "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"normal N\" [0 0 2 0 0 2 0 0 2] \"point2 uv\" [0 0 1 0 0 0.25]";
    let attributes = |before: &str| load(&format!("{before} {mesh}")).unwrap().attributes.unwrap();
    let plain = attributes("Scale 1 1 4");
    let at = |k: usize| plain.corners[0][k] as usize;
    assert_eq!(
        (plain.normals[at(0)], plain.uvs[at(1)], plain.uvs[at(2)]),
        (Vec3::Z, glam::vec2(1.0, 1.0), glam::vec2(0.0, 0.75))
    );
    let reversed = attributes("ReverseOrientation Rotate 90 1 0 0");
    let normal = reversed.normals[reversed.corners[0][0] as usize];
    assert!((normal - Vec3::Y).length() < 1e-6, "{normal}");
}

#[test]
fn materials_keep_their_colours() {
    let material = |statements: &str| {
        let scene = load(&format!("{statements}\n{TRIANGLE}")).unwrap();
        assert!(scene.warnings.is_empty(), "{statements}: {:?}", scene.warnings);
        scene.material(0).clone()
    };
    for (statements, expected) in [
        ("", Vec3::splat(0.5)),
        ("Material \"diffuse\" \"rgb reflectance\" [0.1 0.2 0.3]", Vec3::new(0.1, 0.2, 0.3)),
        ("Material \"matte\" \"color Kd\" [0.1 0.2 0.3]", Vec3::new(0.1, 0.2, 0.3)),
        (
            "MakeNamedMaterial \"a\" \"string type\" \"diffuse\" \"rgb reflectance\" [1 0 0]\n\
             AttributeBegin Material \"diffuse\" AttributeEnd NamedMaterial \"a\"",
            Vec3::X,
        ),
        (
            "Texture \"t\" \"spectrum\" \"constant\" \"rgb value\" [0 1 0]\n\
             Texture \"u\" \"spectrum\" \"scale\" \"texture tex\" \"t\" \"float scale\" 0.5\n\
             Material \"diffuse\" \"texture reflectance\" \"u\"",
            Vec3::Y * 0.5,
        ),
        (
            "Material \"conductor\" \"spectrum eta\" \"metal-Au-eta\" \"spectrum k\" \"metal-Au-k\"",
            Vec3::new(1.0, 0.782, 0.344),
        ),
    ] {
        assert_eq!(material(statements).base_color, expected, "{statements}");
    }
    assert_eq!(material("Material \"dielectric\" \"float eta\" 1.5").transmission, 1.0);
    let gold = material("Material \"conductor\" \"float roughness\" [0.0625]");
    // The width of the microfacets is the root of 0.0625, and the perceptual roughness that of the width.
    assert_eq!((gold.metallic, gold.roughness), (1.0, 0.5));
    let lamp = material("AreaLightSource \"diffuse\" \"rgb L\" [3 2 1] \"float scale\" 2");
    assert_eq!((lamp.emissive, lamp.base_color), (Vec3::new(6.0, 4.0, 2.0), Vec3::splat(0.5)));
    let none = load(&format!("AttributeBegin AreaLightSource \"diffuse\" AttributeEnd {TRIANGLE}")).unwrap();
    assert_eq!(none.material(0).emissive, Vec3::ZERO);
    // One is added only where shapes come before any.
    let count = |statements: &str| load(&format!("{statements}\n{TRIANGLE}")).unwrap().materials.len();
    assert_eq!(["", "Material \"diffuse\""].map(count), [1, 1]);
    assert_eq!(count(&format!("{TRIANGLE}Material \"diffuse\"")), 2);
}

#[test]
fn the_camera_is_the_view_to_start_with() {
    let camera = |before: &str| {
        let text = format!("{before}\nWorldBegin\n{TRIANGLE}");
        let scene = load(&text).unwrap();
        (CameraChoice::default().camera(&scene), scene.up, scene.warnings.entries.len())
    };
    let (wide, up, warnings) = camera(
        "Scale -1 1 1\nLookAt 3 4 5  3 4 1  0 1 0\nCamera \"perspective\" \"float fov\" 60\n\
         Film \"rgb\" \"integer xresolution\" 200 \"integer yresolution\" 100",
    );
    assert!(
        (wide.eye - Vec3::new(3.0, 4.0, 5.0)).length() < 1e-5
            && (wide.target - Vec3::new(3.0, 4.0, 1.0)).length() < 1e-5
    );
    assert!(
        (wide.fov_y.to_degrees() - 60.0).abs() < 1e-4 && up == Vec3::Y && warnings == 0,
        "{wide:?} {up} {warnings}"
    );
    // Of a picture that is twice as high as wide, the field of view is that of the width: tan 30° twice.
    let (high, up, warnings) = camera(
        "Film \"rgb\" \"integer xresolution\" [100] \"integer yresolution\" [200]\n\
         LookAt 0 -9 1  0 0 0  0 0 1\nCamera \"perspective\" \"float fov\" [60]",
    );
    let expected = (2.0 * (1.0_f32 / 3.0).sqrt()).atan() * 2.0;
    // Without a mirror the coordinates are left-handed, as those of the format are.
    assert!((high.fov_y - expected).abs() < 1e-4 && up == Vec3::Z && warnings == 0, "{high:?} {up} {warnings}");
    // A later transform moves the world: the eye is where the camera sees itself.
    let (moved, ..) = camera("LookAt 0 0 9 0 0 0 0 1 0\nTranslate 1 0 0\nCamera \"perspective\"");
    assert!((moved.eye - Vec3::new(-1.0, 0.0, 9.0)).length() < 1e-5, "{moved:?}");
    let (flat, ..) = camera("LookAt 0 0 9 0 0 0 0 1 0\nCamera \"orthographic\" \"float screenwindow\" [-1 1 -3 3]");
    let half = (flat.eye - flat.target).length() * (flat.fov_y * 0.5).tan();
    assert!(flat.projection == Projection::Orthographic && (half - 3.0).abs() < 1e-4, "{flat:?}");
}

#[test]
fn files_beside_the_scene_are_included() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    std::fs::create_dir(folder.path().join("scene")).unwrap();
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float u\n\
               property float v\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
               0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n4 0 1 2 3\n";
    write("scene/quad.ply", ply.as_bytes());
    write("scene/quad.ply.gz", &packed(ply.as_bytes()));
    write("scene/moved.pbrt", format!("Translate 10 0 0\n{TRIANGLE}").as_bytes());
    write("scene/moved.pbrt.gz", &packed(format!("Translate 10 0 0\n{TRIANGLE}").as_bytes()));
    write("outside.pbrt", TRIANGLE.as_bytes());
    write("scene/circle.pbrt", b"Include \"circle.pbrt\"\n");
    let scene = |text: &str| {
        write("scene/a.pbrt", text.as_bytes());
        load_path(&folder.path().join("scene/a.pbrt")).unwrap()
    };
    for name in ["quad.ply", "quad.ply.gz"] {
        let found = scene(&format!("Translate 0 0 1 Shape \"plymesh\" \"string filename\" \"{name}\""));
        let attributes = found.attributes.as_ref().unwrap();
        assert_eq!((found.triangles.len(), found.bounds.max, found.files_read.len()), (2, Vec3::ONE, 2));
        assert_eq!(attributes.uvs[attributes.corners[0][2] as usize], glam::vec2(1.0, 0.0), "{:?}", found.warnings);
        assert!(found.warnings.is_empty());
    }
    // Changes by an included file stay, changes by an imported one do not.
    for (statement, name, far) in
        [("Include", "moved.pbrt", 21.0), ("Import", "moved.pbrt", 11.0), ("Include", "moved.pbrt.gz", 21.0)]
    {
        let found = scene(&format!("{statement} \"{name}\" Translate 10 0 0\n{TRIANGLE}"));
        assert_eq!((found.triangles.len(), found.bounds.max.x), (2, far), "{statement} {name}: {:?}", found.warnings);
    }
    for (statement, what) in [
        ("Include \"circle.pbrt\"", "1 file included 16 deep, perhaps in a circle, not read (first at circle.pbrt:1)"),
        ("Include \"none.pbrt\"", "1 file 'none.pbrt' not read: there is no such file (first at line 1)"),
        ("Include \"../outside.pbrt\"", "1 file '../outside.pbrt' not read: it lies outside the model's folder"),
        ("Shape \"plymesh\" \"string filename\" \"none.ply\"", "1 mesh 'none.ply' left out: there is no such file"),
        ("Shape \"plymesh\" \"string filename\" \"moved.pbrt\"", "1 mesh 'moved.pbrt' left out: "),
    ] {
        let found = scene(&format!("{statement}\n{TRIANGLE}")).warnings.entries;
        assert!(found.len() == 1 && found[0].to_string().starts_with(what), "{statement}: {found:?}");
    }
}

#[test]
fn each_kind_is_counted_with_its_first_place() {
    for (statements, count, what, line) in [
        ("LightSource \"distant\"\n\nLightSource \"infinite\" \"string filename\" \"a.exr\"", 2, "lights not used", 2),
        ("Shape \"curve\" \"float width\" 1", 1, "shapes of the kind 'curve' not shown", 2),
        ("Shape \"trianglemesh\" \"point3 Q\" [0]", 1, "meshes without positions (P) left out", 2),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 1 1 2 2 2 3 3 3]", 1, "meshes without indices left out", 2),
        (
            "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0] \"integer indices\" [0 1 9 0 1 -1 0 1 0.5 0 1]",
            3,
            "faces with a vertex that does not exist skipped",
            2,
        ),
        ("Shape \"plymesh\"", 1, "meshes without the name of a file left out", 2),
        ("Shape \"disk\" \"float alpha\" 0", 1, "shapes with an alpha of 0 left out", 2),
        ("Shape \"disk\" \"texture alpha\" \"holes\"", 1, "parameters 'alpha' of shapes not used", 2),
        ("Material \"interface\" Shape \"disk\" Material \"diffuse\"", 1, "shapes without a surface left out", 2),
        ("Material \"hair\"", 1, "materials of the kind 'hair' shown without what is special of them", 2),
        (
            "Material \"diffuse\" \"texture displacement\" \"bumps\"",
            1,
            "parameters 'displacement' of materials not used",
            2,
        ),
        (
            "Material \"diffuse\" \"spectrum reflectance\" [400 0.5 700 0.5]",
            1,
            "colours by wavelength shown in grey",
            2,
        ),
        ("NamedMaterial \"a\" NamedMaterial \"b\"", 2, "materials 'a' … without a definition shown in clay", 2),
        ("Texture \"a\" \"spectrum\" \"checkerboard\"", 1, "textures of the kind 'checkerboard' not shown", 2),
        ("ObjectInstance \"a\"", 1, "copies of objects 'a' without a definition left out", 2),
        ("CoordSysTransform \"a\"", 1, "uses of the coordinate system 'a' without a definition passed over", 2),
        ("AttributeEnd", 1, "ends of blocks that have not begun", 2),
        ("AttributeBegin\nTransformBegin", 2, "blocks without an end", 5),
        ("ActiveTransform EndTime Translate 9 0 0 ActiveTransform All", 1, "motions shown at the start", 2),
        ("LookAt 1 1 1 1 1 1 0 1 0", 1, "views without a direction left out", 2),
        ("Camera \"spherical\"", 1, "cameras of other kinds shown in perspective", 2),
        (
            "Camera \"perspective\" \"float fov\" 180",
            1,
            "cameras with a field of view that is not between 0 and 180 degrees shown with 90",
            2,
        ),
        ("Rotate 30 0 0 0", 1, "rotations without an axis left out", 2),
        (
            "Shape \"trianglemesh\" \"point3 P\" [0 0 0 1 0 0 0 1 0 7] \"integer indices\" [0 1 2]",
            1,
            "numbers of 'P' left over after the last point",
            2,
        ),
        (
            "Texture \"a\" \"spectrum\" \"scale\" \"texture tex\" \"a\" \"rgb scale\" [1 1 1]",
            1,
            "uses of the texture 'a' without a definition left out",
            2,
        ),
        ("Attribute \"shape\" \"float radius\" 2", 1, "statements 'Attribute' not used", 2),
        ("\nWhat \"is\" [1 2] 3 true", 2, "statements not understood and skipped, 'What' being the first", 3),
    ] {
        let text = format!("WorldBegin\n{statements}\n{TRIANGLE}");
        let found = load(&text).unwrap_or_else(|error| panic!("{statements}: {error}")).warnings.entries;
        let first = found.iter().find(|warning| warning.what == what);
        let first = first.unwrap_or_else(|| panic!("{statements}: {found:?}"));
        assert_eq!(
            (first.count, first.to_string()),
            (count, {
                let counted = first.to_string();
                let start = counted.split(" (first at").next().unwrap().to_owned();
                format!("{start} (first at line {line})")
            }),
            "{statements}"
        );
    }
}

#[test]
fn sound_statements_about_pictures_are_silent() {
    for statements in [
        "Option \"string seed\" [123]\nOption \"bool pixelstats\" [true]",
        "Option \"disablepixeljitter\" true\nOption \"seed\" 7",
        "LookAt 0 0 -5  0 0 0  0 1 0\nCamera \"perspective\" \"float fov\" [60]",
        "Camera \"orthographic\" \"float fov\" [0]",
        // Of a right-handed program.
        "Scale -1 1 1\nCamera \"perspective\"",
    ] {
        let scene = load(&format!("{statements}\nWorldBegin\n{TRIANGLE}")).unwrap();
        assert!(scene.warnings.is_empty(), "{statements}: {:?}", scene.warnings);
    }
}

#[test]
fn fields_of_view_that_are_none_are_counted_and_replaced() {
    for fov in ["0", "-5", "180", "1e308", "nan"] {
        let scene = load(&format!("Camera \"perspective\" \"float fov\" {fov}\nWorldBegin\n{TRIANGLE}")).unwrap();
        assert_eq!(scene.warnings.entries.len(), 1, "{fov}: {:?}", scene.warnings);
        assert!((scene.cameras[0].fov_y.to_degrees() - 90.0).abs() < 1e-3, "{fov}");
    }
}

#[test]
fn ends_of_objects_and_attributes_may_be_exchanged() {
    let bolt = |inside: &str| {
        let text = format!(
            "WorldBegin\nAttributeBegin\nTranslate 9 0 0\nObjectBegin \"bolt\"\n{inside}\nObjectInstance \"bolt\""
        );
        let scene = load(&text).unwrap();
        let places: Vec<f32> = scene.triangles.iter().map(|triangle| triangle.a.x).collect();
        (places, scene.warnings.entries.len())
    };
    let shape = format!("AttributeBegin\nTranslate 5 0 0\n{TRIANGLE}\nAttributeEnd");
    // Version 3 keeps one stack: the first end is that of the object's block, the second that of the attributes around it.
    assert_eq!(bolt(&format!("{shape}\nAttributeEnd\nObjectEnd")), (vec![14.0], 0));
    assert_eq!(bolt(&format!("{shape}\nObjectEnd\nAttributeEnd")), (vec![14.0], 0));
    // What follows the object is no part of it.
    let twice = format!("{shape}\nAttributeEnd\nObjectEnd\n{TRIANGLE}");
    assert_eq!(bolt(&twice), (vec![0.0, 14.0], 0));
}

#[test]
fn broken_scenes_are_refused_with_place_and_remedy() {
    let many = "AttributeBegin\n".repeat(5000);
    for (text, place, problem) in [
        ("WorldBegin\n", "a.pbrt: ", "contains no triangles; export the model as a triangle mesh"),
        ("Shape", "a.pbrt:1: ", "a text in quotes is missing; it may be cut off"),
        ("Shape sphere", "a.pbrt:1: ", "'sphere' stands where a text in quotes is expected; correct the line"),
        ("Shape \"sphere", "a.pbrt:1: ", "the text has no closing quote in its line"),
        ("WorldBegin\nShape \"sphere\n\"", "a.pbrt:2: ", "the text has no closing quote in its line"),
        ("Shape \"sphere\" \"float radius\"", "a.pbrt:1: ", "a number is missing; it may be cut off"),
        ("Shape \"sphere\" \"float radius\" [1", "a.pbrt:1: ", "a list is not closed by ']'; it may be cut off"),
        ("Shape \"sphere\" \"float radius\" [1 [2", "a.pbrt:1: ", "a number is missing"),
        ("Shape \"sphere\"\n\"float radius\" 1,5", "a.pbrt:2: ", "'1,5' is not a number; write decimals with a point"),
        ("Shape \"sphere\" \"float radius\" [1 true]", "a.pbrt:1: ", "'true' is not a number"),
        ("Shape \"sphere\" \"bool a\" [\"b\" 3]", "a.pbrt:1: ", "a list is not closed by ']'; correct the line"),
        ("WorldBegin\n\nTranslate 1 2", "a.pbrt:3: ", "a number is missing"),
        ("WorldBegin\nTranslate 1 2 \"x\"", "a.pbrt:2: ", "a number is missing"),
        ("WorldBegin\nTranslate [1 2 3 4]", "a.pbrt:2: ", "a list is not closed by ']'"),
        ("Transform [1 2 3]", "a.pbrt:1: ", "a number is missing"),
        ("Transform [1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 one]", "a.pbrt:1: ", "'one' is not a number"),
        ("LookAt 0 0 0", "a.pbrt:1: ", "a number is missing"),
        ("Camera", "a.pbrt:1: ", "a text in quotes is missing"),
        ("Texture \"a\" \"spectrum\"", "a.pbrt:1: ", "a text in quotes is missing"),
        ("Include 5", "a.pbrt:1: ", "'5' stands where a text in quotes is expected"),
        ("ObjectBegin [", "a.pbrt:1: ", "'' stands where a text in quotes is expected"),
        (
            "Shape \"trianglemesh\" \"point3 P\" [0 0 nan 1 0 0 0 1 0]",
            "a.pbrt: ",
            "coordinates that are not numbers skipped",
        ),
        ("Shape \"trianglemesh\" \"point3 P\" [0 0 1e40 1 0 0 0 1 0]", "a.pbrt: ", "contains no triangles"),
        ("Scale 0 0 1e300 Scale 1 1 1e300 Shape \"disk\"", "a.pbrt: ", "contains no triangles"),
        (&many, "a.pbrt:4097: ", "stands within more than 4096 blocks"),
    ] {
        let message = load(text).err().map_or_else(|| panic!("{text} loads"), |error| error.to_string());
        assert!(message.starts_with(place) && message.contains(problem), "{text}: {message}");
    }
}

#[test]
fn scenes_are_known_by_their_first_statement() {
    let text = format!("# made by hand\n\nLookAt 0 0 5 0 0 0 0 1 0\nWorldBegin\n{TRIANGLE}");
    let named = |name: &str, text: &str| {
        load_bytes(Path::new(name), text.as_bytes(), &LoadOptions::default(), &CancelToken::new())
    };
    for name in ["a.pbrt", "a", "a.PBRT.GZ"] {
        assert_eq!(named(name, &text).unwrap().triangles.len(), 1, "{name}");
    }
    let warning = named("a.obj", &text).unwrap().warnings.entries[0].to_string();
    assert!(warning.contains("the file is PBRT, not OBJ"), "{warning}");
    let message = named("a.pbrt", "Dear user\n").unwrap_err().to_string();
    assert!(message.contains("is text that begins with 'Dear user', not PBRT"), "{message}");
}

#[test]
fn scenes_far_from_the_origin_keep_their_decimals() {
    let scene = load(&format!("Translate 408201.58 4080928 0 Scale 4 0.1 1\n{TRIANGLE}")).unwrap();
    assert!((scene.bounds.extent() - Vec3::new(4.0, 0.1, 0.0)).abs().max_element() < 1e-5, "{:?}", scene.bounds);
    assert!(scene.offset.y > 4e6);
}

#[test]
fn copies_without_measure_are_refused() {
    let object = format!("ObjectBegin \"a\"\n{}ObjectEnd\n", "Shape \"sphere\"\n".repeat(100));
    let options = LoadOptions { instances: Instancing::Flat, ..LoadOptions::default() };
    let text = object + &"ObjectInstance \"a\"\n".repeat(2800);
    let message =
        load_bytes(Path::new("a.pbrt"), text.as_bytes(), &options, &CancelToken::new()).unwrap_err().to_string();
    // 960 triangles for each sphere.
    assert!(message.contains("contains 268800000 triangles with all copies, more than 268435456"), "{message}");
}
