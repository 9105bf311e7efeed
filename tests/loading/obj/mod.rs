//! The OBJ reader and its material libraries: exact values, materials, warnings and refusals, and valid files beside the crate
//! tobj.

mod generator;
mod materials;
mod obj_oracle;
mod values;
mod warnings;
