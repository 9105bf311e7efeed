//! What is read of a glTF document. Everything is optional, since files lack what the specification demands; fields that nothing
//! here needs are skipped, whatever they hold.

use serde::Deserialize;

use super::json::{Flag, Label, List, Named, Object, Present, Real, Reals, Text, Whole};

/// Declares structs whose fields are optional and have their glTF names in camel case.
macro_rules! objects {
    ($($(#[$doc:meta])* $name:ident { $($(#[$attribute:meta])* $field:ident: $kind:ty,)* })*) => {$(
        $(#[$doc])*
        #[derive(Debug, Clone, Default, Deserialize)]
        #[serde(rename_all = "camelCase", default)]
        pub(super) struct $name { $($(#[$attribute])* pub(super) $field: $kind,)* }
    )*};
}

objects! {
    /// The part of a document that says which version it is.
    Versioned { asset: Object<Asset>, }
    /// A document.
    Root {
        asset: Object<Asset>,
        extensions_required: List<Text>,
        scene: Option<Whole>,
        scenes: List<Object<Scene>>,
        nodes: List<Object<Node>>,
        meshes: List<Object<Mesh>>,
        accessors: List<Object<Accessor>>,
        buffer_views: List<Object<View>>,
        buffers: List<Object<Buffer>>,
        materials: List<Object<Material>>,
        textures: List<Object<Texture>>,
        images: List<Object<Image>>,
        samplers: List<Object<Sampler>>,
        cameras: List<Present>,
        animations: List<Present>,
        extensions: Object<RootExtensions>,
    }
    RootExtensions { #[serde(rename = "KHR_lights_punctual")] lights: Object<Lights>, }
    Lights { lights: List<Present>, }
    Asset { version: Option<Label>, min_version: Option<Label>, }
    Scene { nodes: List<Whole>, }
    Node {
        children: List<Whole>,
        mesh: Option<Whole>,
        skin: Option<Whole>,
        matrix: Option<Reals<16>>,
        translation: Option<Reals<3>>,
        rotation: Option<Reals<4>>,
        scale: Option<Reals<3>>,
        extensions: Object<NodeExtensions>,
    }
    NodeExtensions { #[serde(rename = "EXT_mesh_gpu_instancing")] instancing: Option<Box<Object<Instancing>>>, }
    Instancing { attributes: Named, }
    Mesh { primitives: List<Object<Primitive>>, }
    Primitive {
        attributes: Named,
        indices: Option<Whole>,
        material: Option<Whole>,
        mode: Option<Whole>,
        targets: List<Present>,
        extensions: Object<PrimitiveExtensions>,
    }
    PrimitiveExtensions { #[serde(rename = "KHR_draco_mesh_compression")] draco: Option<Present>, }
    Accessor {
        buffer_view: Option<Whole>,
        byte_offset: Whole,
        component_type: Option<Whole>,
        normalized: Flag,
        count: Whole,
        #[serde(rename = "type")]
        shape: Option<Text>,
        sparse: Option<Box<Object<Sparse>>>,
    }
    Sparse { count: Whole, indices: Object<SparseIndices>, values: Object<SparseValues>, }
    SparseIndices { buffer_view: Option<Whole>, byte_offset: Whole, component_type: Option<Whole>, }
    SparseValues { buffer_view: Option<Whole>, byte_offset: Whole, }
    View {
        buffer: Option<Whole>,
        byte_offset: Whole,
        byte_length: Whole,
        byte_stride: Option<Whole>,
        extensions: Object<ViewExtensions>,
    }
    ViewExtensions {
        #[serde(rename = "EXT_meshopt_compression", alias = "KHR_meshopt_compression")]
        meshopt: Option<Present>,
    }
    Buffer { uri: Option<Text>, byte_length: Whole, extensions: Object<ViewExtensions>, }
    Material {
        name: Option<Label>,
        pbr_metallic_roughness: Object<Surface>,
        emissive_factor: Option<Reals<3>>,
        emissive_texture: Option<Object<TextureInfo>>,
        normal_texture: Option<Object<TextureInfo>>,
        occlusion_texture: Option<Object<TextureInfo>>,
        alpha_mode: Option<Text>,
        alpha_cutoff: Option<Real>,
        extensions: Object<MaterialExtensions>,
    }
    Surface {
        base_color_factor: Option<Reals<4>>,
        base_color_texture: Option<Object<TextureInfo>>,
        metallic_factor: Option<Real>,
        roughness_factor: Option<Real>,
        metallic_roughness_texture: Option<Object<TextureInfo>>,
    }
    MaterialExtensions {
        #[serde(rename = "KHR_materials_unlit")]
        unlit: Option<Present>,
        #[serde(rename = "KHR_materials_emissive_strength")]
        strength: Object<Strength>,
        #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
        specular_glossiness: Option<Present>,
    }
    Strength { emissive_strength: Option<Real>, }
    TextureInfo {
        index: Option<Whole>,
        tex_coord: Whole,
        scale: Option<Real>,
        strength: Option<Real>,
        extensions: Object<InfoExtensions>,
    }
    InfoExtensions { #[serde(rename = "KHR_texture_transform")] transform: Option<Object<Transform>>, }
    Transform {
        offset: Option<Reals<2>>,
        rotation: Real,
        scale: Option<Reals<2>>,
        tex_coord: Option<Whole>,
    }
    Texture { source: Option<Whole>, sampler: Option<Whole>, extensions: Object<TextureExtensions>, }
    TextureExtensions {
        #[serde(rename = "KHR_texture_basisu")]
        basisu: Option<Present>,
        #[serde(rename = "EXT_texture_webp")]
        webp: Option<Present>,
    }
    Image { uri: Option<Text>, buffer_view: Option<Whole>, }
    Sampler { wrap_s: Option<Whole>, wrap_t: Option<Whole>, }
}
