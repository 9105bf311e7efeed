//! Which of the real models are looked at from within.

use bvhscope::scene::{LoadOptions, SceneSource, load};
use bvhscope_engine::cancel::CancelToken;

use crate::support::models;

#[test]
fn rooms_open_inside_and_objects_outside() {
    let Some(folder) = models() else { return };
    for (file, is_room) in [
        ("conference/conference.obj", true),
        ("sponza-dabrovic/sponza.obj", true),
        ("sponza-crytek/sponza.obj", true),
        ("car/pontiac-gto67.glb", false),
        ("bunny/bunny.obj", false),
        ("teapot/teapot.obj", false),
        // Its faces are turned inside out.
        ("teapot/teapot-quads.obj", false),
        ("cornell/cornell_box.obj", false),
    ] {
        let path = folder.join(file);
        let scene = load(&SceneSource::File(path), &LoadOptions::default(), &CancelToken::new()).unwrap();
        assert_eq!(scene.interior.is_some(), is_room, "{file}");
        if let Some(interior) = scene.interior {
            for point in [interior.eye, interior.target] {
                let inside = scene.bounds.min.cmplt(point).all() && point.cmplt(scene.bounds.max).all();
                assert!(inside, "{file}: {interior:?} in {:?}", scene.bounds);
            }
        }
    }
}
