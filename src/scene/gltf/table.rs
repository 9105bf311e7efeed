//! The fields of a glTF document that are read, as one table: the kind of each value, the list that each index points into, and
//! the consequence of an index that points nowhere. Fields that are not in the table are skipped, whatever they hold.

use self::Lost::{Empty, Field, Owner};
use self::Rule::{
    Attributes, Code, Extensions, Flag, Index, Label, List, Needed, Number, Numbers, Object, Present, Raw, Set, Text,
    Whole, Word,
};
use crate::scene::images::READS_KTX2;

/// The kind of a value.
pub(super) enum Rule {
    /// An index into a top-level list.
    Index(Target),
    /// One of a few whole numbers.
    Code(&'static [u64], Lost, &'static str),
    /// One of a few words.
    Word(&'static [&'static str], Lost, &'static str),
    /// A whole number of at least 0.
    Whole,
    /// The number of a set of attributes; numbers beyond 32 bits become the largest.
    Set,
    /// A number.
    Number,
    /// A list of this many numbers.
    Numbers(usize),
    /// A text.
    Text,
    /// A text, or a number, which becomes its text.
    Label,
    /// True or false.
    Flag,
    /// Anything; becomes an empty object, since only its presence matters.
    Present,
    /// Anything; is checked where it is read.
    Raw,
    /// A list of values of one kind.
    List(&'static Rule),
    /// An object with these fields.
    Object(&'static [Row]),
    /// An object whose fields are extensions; those that are not listed are counted.
    Extensions(&'static [Row]),
    /// An object whose fields are vertex attributes, each an index.
    Attributes(&'static Target),
    /// A value without which its owner cannot be read.
    Needed(&'static Rule),
}

/// A field and the kind of its value.
pub(super) type Row = (&'static str, Rule);

/// The list that an index points into.
#[derive(Clone, Copy)]
pub(super) struct Target {
    /// The name of the list.
    pub(super) list: &'static str,
    /// The consequence if it has no such entry.
    pub(super) lost: Lost,
    /// The warning about it.
    pub(super) warning: &'static str,
}

/// The consequence of a value that cannot be used.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Lost {
    /// The field or the item of a list is removed.
    Field,
    /// The index points to the empty entry that is appended to the list.
    Empty,
    /// The entry around it, a primitive or an entry of a top-level list, is replaced by an empty one.
    Owner,
}

/// The empty entries of lists, as JSON. Each list gets one at its end.
pub(super) const EMPTY_ENTRIES: [(&str, &str); 5] = [
    ("buffers", r#"{"byteLength": 0, "uri": "data:,"}"#),
    ("accessors", r#"{"componentType": 5121, "type": "SCALAR", "count": 0}"#),
    ("textures", "{}"),
    ("images", r#"{"uri": ""}"#),
    ("skins", r#"{"joints": []}"#),
];

/// Names of extensions.
pub(super) mod extension {
    pub(in super::super) const BASISU: &str = "KHR_texture_basisu";
    pub(in super::super) const DRACO: &str = "KHR_draco_mesh_compression";
    pub(in super::super) const INSTANCING: &str = "EXT_mesh_gpu_instancing";
    pub(in super::super) const POINTER: &str = "KHR_animation_pointer";
    pub(in super::super) const VISIBILITY: &str = "KHR_node_visibility";
    pub(in super::super) const LIGHTS: &str = "KHR_lights_punctual";
    pub(in super::super) const MESHOPT: [&str; 2] = ["EXT_meshopt_compression", "KHR_meshopt_compression"];
    pub(in super::super) const SPECULAR_GLOSSINESS: &str = "KHR_materials_pbrSpecularGlossiness";
    pub(in super::super) const TRANSMISSION: &str = "KHR_materials_transmission";
    pub(in super::super) const TRANSFORM: &str = "KHR_texture_transform";
    pub(in super::super) const WEBP: &str = "EXT_texture_webp";
    /// Ours: the mark of a primitive that was replaced by an empty one and counted.
    pub(in super::super) const LOST: &str = "lost";
}

const fn to(list: &'static str, lost: Lost, warning: &'static str) -> Rule {
    Index(Target { list, lost, warning })
}

/// A document, its version first.
pub(super) static DOCUMENT: [Row; 17] = [
    ("asset", Needed(&ASSET)),
    ("extensionsRequired", List(&Text)),
    ("scene", to("scenes", Field, "scenes out of range replaced by the first")),
    ("scenes", List(&SCENE)),
    ("nodes", List(&NODE)),
    ("meshes", List(&MESH)),
    ("skins", List(&SKIN)),
    ("accessors", List(&ACCESSOR)),
    ("bufferViews", List(&VIEW)),
    ("buffers", List(&BUFFER)),
    ("materials", List(&MATERIAL)),
    ("textures", List(&TEXTURE)),
    ("images", List(&IMAGE)),
    ("samplers", List(&SAMPLER)),
    ("cameras", List(&CAMERA)),
    ("animations", Raw),
    ("extensions", Extensions(&[(extension::LIGHTS, Object(&[("lights", List(&LIGHT))]))])),
];

static ASSET: Rule = Object(&[("version", Label), ("minVersion", Label)]);

static CHILD: Rule = to("nodes", Field, "nodes out of range left out");

static SCENE: Rule = Object(&[("name", Label), ("nodes", Needed(&List(&CHILD))), ("extensions", Extensions(&[]))]);

static NODE: Rule = Object(&[
    ("children", List(&CHILD)),
    ("mesh", to("meshes", Field, "nodes of a mesh that does not exist left out")),
    ("camera", to("cameras", Field, "nodes with a camera that does not exist placed without it")),
    ("skin", to("skins", Field, "meshes with a skeleton that does not exist placed by their node")),
    ("matrix", Numbers(16)),
    ("translation", Numbers(3)),
    ("rotation", Numbers(4)),
    ("scale", Numbers(3)),
    ("weights", List(&Number)),
    (
        "extensions",
        Extensions(&[
            (extension::INSTANCING, INSTANCING),
            (extension::LIGHTS, CARRIED_LIGHT),
            (extension::VISIBILITY, Object(&[("visible", Flag)])),
        ]),
    ),
]);

/// The lights of a document as a list that indices point into, though it is not at the top.
pub(super) const LIGHTS_LIST: &str = "lights";

const CARRIED_LIGHT: Rule =
    Object(&[("light", to(LIGHTS_LIST, Field, "nodes with a light that does not exist placed without it"))]);

static LIGHT: Rule = Object(&[
    ("name", Label),
    ("type", Needed(&LIGHT_TYPE)),
    ("color", Numbers(3)),
    ("intensity", Number),
    ("range", Number),
    ("spot", Object(&[("innerConeAngle", Number), ("outerConeAngle", Number)])),
]);

static LIGHT_TYPE: Rule = Word(&["directional", "point", "spot"], Field, "lights of an unknown type left out");

static CAMERA: Rule = Object(&[
    ("name", Label),
    ("perspective", Object(&[("yfov", Number)])),
    ("orthographic", Object(&[("ymag", Number)])),
]);

const INSTANCING: Rule =
    Object(&[("attributes", Object(&[("TRANSLATION", INSTANCES), ("ROTATION", INSTANCES), ("SCALE", INSTANCES)]))]);

const INSTANCES: Rule = to("accessors", Field, "lists of instances left out: something named that does not exist");

static MESH: Rule =
    Object(&[("primitives", Needed(&List(&PRIMITIVE))), ("weights", List(&Number)), ("extensions", Extensions(&[]))]);

const NO_PRIMITIVE: &str = "primitives left out: something named that does not exist";

static PRIMITIVE: Rule = Object(&[
    ("attributes", Needed(&Attributes(&ATTRIBUTE))),
    ("indices", to("accessors", Owner, NO_PRIMITIVE)),
    ("material", to("materials", Field, "primitives whose material does not exist shown in clay")),
    ("mode", Code(&[0, 1, 2, 3, 4, 5, 6], Owner, "primitives left out: an unknown mode")),
    ("targets", List(&MORPH_TARGET)),
    ("extensions", Extensions(&[(extension::DRACO, Raw)])),
]);

static MORPH_TARGET: Rule = Object(&[("POSITION", MORPHED), ("NORMAL", MORPHED)]);

const MORPHED: Rule = to("accessors", Field, "morph targets left out: something named that does not exist");

static ATTRIBUTE: Target = Target {
    list: "accessors",
    lost: Field,
    warning: "primitives shown without an attribute: something named that does not exist",
};

/// The attribute without which a primitive cannot be read.
pub(super) static POSITION: Target = Target { list: "accessors", lost: Owner, warning: NO_PRIMITIVE };

const NO_SKIN: &str = "skeletons left out: something named that does not exist";

static SKIN: Rule = Object(&[
    ("inverseBindMatrices", to("accessors", Owner, NO_SKIN)),
    ("joints", Needed(&List(&Index(Target { list: "nodes", lost: Owner, warning: NO_SKIN })))),
    ("extensions", Extensions(&[])),
]);

const NO_VIEW: &str = "accessors left empty: something named that does not exist";
const NO_TYPE: &str = "accessors left empty: numbers of a wrong type";

static ACCESSOR: Rule = Object(&[
    ("bufferView", to("bufferViews", Owner, NO_VIEW)),
    ("byteOffset", Whole),
    ("componentType", Needed(&Code(&[5120, 5121, 5122, 5123, 5125, 5126], Owner, NO_TYPE))),
    ("normalized", Flag),
    ("count", Needed(&Whole)),
    ("type", Needed(&Word(&["SCALAR", "VEC2", "VEC3", "VEC4", "MAT2", "MAT3", "MAT4"], Owner, NO_TYPE))),
    ("sparse", SPARSE),
    ("extensions", Extensions(&[])),
]);

const SPARSE: Rule = Object(&[
    ("count", Needed(&Whole)),
    (
        "indices",
        Needed(&Object(&[
            ("bufferView", Needed(&SPARSE_VIEW)),
            ("byteOffset", Whole),
            ("componentType", Needed(&Code(&[5121, 5123, 5125], Owner, NO_TYPE))),
        ])),
    ),
    ("values", Needed(&Object(&[("bufferView", Needed(&SPARSE_VIEW)), ("byteOffset", Whole)]))),
]);

static SPARSE_VIEW: Rule = to("bufferViews", Owner, NO_VIEW);

static VIEW: Rule = Object(&[
    ("buffer", Needed(&NAMED_BUFFER)),
    ("byteOffset", Whole),
    ("byteLength", Needed(&Whole)),
    ("byteStride", Whole),
    ("extensions", COMPRESSED),
]);

static NAMED_BUFFER: Rule = to("buffers", Empty, "buffer views left empty: something named that does not exist");

const COMPRESSED: Rule = Extensions(&[(extension::MESHOPT[0], Raw), (extension::MESHOPT[1], Raw)]);

static BUFFER: Rule = Object(&[("uri", Text), ("byteLength", Whole), ("extensions", COMPRESSED)]);

static MATERIAL: Rule = Object(&[
    ("name", Label),
    ("pbrMetallicRoughness", SURFACE),
    ("emissiveFactor", Numbers(3)),
    ("emissiveTexture", MAP),
    ("normalTexture", MAP),
    ("occlusionTexture", MAP),
    ("alphaMode", Word(&["OPAQUE", "MASK", "BLEND"], Field, "materials with an unknown alphaMode shown opaque")),
    ("alphaCutoff", Number),
    (
        "extensions",
        Extensions(&[
            ("KHR_materials_unlit", Present),
            ("KHR_materials_emissive_strength", Object(&[("emissiveStrength", Number)])),
            (extension::SPECULAR_GLOSSINESS, Present),
            (extension::TRANSMISSION, Object(&[("transmissionFactor", Number), ("transmissionTexture", Present)])),
        ]),
    ),
]);

const SURFACE: Rule = Object(&[
    ("baseColorFactor", Numbers(4)),
    ("baseColorTexture", MAP),
    ("metallicFactor", Number),
    ("roughnessFactor", Number),
    ("metallicRoughnessTexture", MAP),
    ("extensions", Extensions(&[])),
]);

/// A reference to a texture.
const MAP: Rule = Object(&[
    ("index", Needed(&NAMED_TEXTURE)),
    ("texCoord", Set),
    ("scale", Number),
    ("strength", Number),
    ("extensions", Extensions(&[(extension::TRANSFORM, TRANSFORM)])),
]);

static NAMED_TEXTURE: Rule = to("textures", Empty, "materials shown without a texture that does not exist");

const TRANSFORM: Rule =
    Object(&[("offset", Numbers(2)), ("rotation", Number), ("scale", Numbers(2)), ("texCoord", Set)]);

/// Warning about a texture without texels.
pub(super) const NO_IMAGE: &str = "textures without an image that can be read";

static TEXTURE: Rule = Object(&[
    ("source", to("images", Empty, NO_IMAGE)),
    ("sampler", to("samplers", Field, "textures whose sampler does not exist repeated")),
    (
        "extensions",
        Extensions(&[
            (
                extension::BASISU,
                if READS_KTX2 { Object(&[("source", to("images", Empty, NO_IMAGE))]) } else { Present },
            ),
            (extension::WEBP, Object(&[("source", to("images", Empty, NO_IMAGE))])),
        ]),
    ),
]);

static IMAGE: Rule = Object(&[
    ("uri", Text),
    ("bufferView", to("bufferViews", Field, "images without their data: something named that does not exist")),
    ("extensions", Extensions(&[])),
]);

static SAMPLER: Rule = Object(&[("wrapS", WRAP), ("wrapT", WRAP)]);

const WRAP: Rule = Code(&[10_497, 33_071, 33_648], Field, "textures with an unknown wrap mode repeated");
