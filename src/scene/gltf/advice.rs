//! Remedies that several refusals and warnings name.

/// What to do about compressed data and unknown extensions.
pub(super) const UNPACK: &str =
    "convert the file with 'gltf-transform optimize --compress false --texture-compress false IN OUT'";

/// What to do about glTF 1.0.
pub(super) const UPGRADE: &str = "convert it with 'gltf-pipeline -i IN -o OUT', or export the model as glTF 2.0";
