//! Embree's scenes of a mesh that moves.

#![allow(unsafe_code, reason = "Embree is a C library; only the embree*.rs files touch it")]

use std::cell::RefCell;
use std::ffi::{c_uint, c_void};
use std::rc::Rc;

use glam::Vec3;

use crate::embree::{
    BUFFER_INDEX, BUFFER_VERTEX, Device, FORMAT_FLOAT3, FORMAT_UINT3, GEOMETRY_TRIANGLE, Mesh, Mode, Quality, Scene,
};
use crate::embree_library::Common;
use crate::embree_rays;
use crate::motion::Twist;
use crate::peer::{BuildTimes, Updater, timed};

/// Flag of scenes whose geometries change often.
const SCENE_DYNAMIC: c_uint = 1;

/// A dynamic scene of vertices of its own, which move.
struct DynamicScene<'a> {
    scene: Scene<'a>,
    geometry: *mut c_void,
    vertices: Box<[[f32; 3]]>,
}

impl<'a> DynamicScene<'a> {
    /// Builds the scene at rest.
    fn new(device: &Device, mesh: &'a Mesh, quality: Quality) -> Self {
        let Common { new_scene, new_geometry, set_buffer, attach_geometry, .. } = device.library.common;
        let vertices: Box<[[f32; 3]]> = mesh.vertices.clone().into();
        // SAFETY: as for `commit`; the vertices stay where they are as long as the scene, which is released before them.
        let (scene, geometry) = unsafe {
            let scene = new_scene(device.handle());
            (device.library.common.set_scene_flags)(scene, SCENE_DYNAMIC);
            let geometry = new_geometry(device.handle(), GEOMETRY_TRIANGLE);
            let (corners, indices) = (vertices.as_ptr().cast(), mesh.indices.as_ptr().cast());
            set_buffer(geometry, BUFFER_VERTEX, 0, FORMAT_FLOAT3, corners, 0, 12, vertices.len() - 1);
            set_buffer(geometry, BUFFER_INDEX, 0, FORMAT_UINT3, indices, 0, 12, mesh.indices.len());
            attach_geometry(scene, geometry);
            (scene, geometry)
        };
        let mode = Mode { quality, is_robust: false, has_filter: false };
        let scene = Scene::owning(device.library, mode, scene, 0);
        let dynamic = Self { scene, geometry, vertices };
        dynamic.commit();
        device.check();
        dynamic
    }

    /// Commits vertices that have changed.
    fn commit(&self) {
        let Common { set_scene_quality, set_geometry_quality, update_buffer, commit_geometry, commit_scene, .. } =
            self.scene.library.common;
        // SAFETY: scene and geometry are alive, and so are the buffers.
        unsafe {
            set_scene_quality(self.scene.handle(), Quality::Low as c_uint);
            set_geometry_quality(self.geometry, self.scene.mode.quality as c_uint);
            update_buffer(self.geometry, BUFFER_VERTEX, 0);
            commit_geometry(self.geometry);
            commit_scene(self.scene.handle());
        }
    }
}

impl Drop for DynamicScene<'_> {
    fn drop(&mut self) {
        // SAFETY: the reference that was made with the geometry.
        unsafe { (self.scene.library.common.release_geometry)(self.geometry) };
    }
}

/// Every update of a dynamic scene: fitted, or built again.
pub fn updaters<'a>(device: &'a Device, mesh: &'a Mesh, twist: &'a Twist, threads: usize) -> Vec<Updater<'a>> {
    let updater = |quality: Quality| {
        let dynamic = Rc::new(RefCell::new(DynamicScene::new(device, mesh, quality)));
        let traced = Rc::clone(&dynamic);
        let name = if quality == Quality::Refit { "refit".to_owned() } else { format!("{}, rebuild", quality.name()) };
        Updater {
            engine: device.library.name,
            name,
            threads,
            update: Box::new(move |moment| {
                let mut dynamic = dynamic.borrow_mut();
                for (vertex, at_rest) in dynamic.vertices.iter_mut().zip(&mesh.vertices) {
                    *vertex = twist.moved(Vec3::from_array(*at_rest), moment).to_array();
                }
                let ready = timed(|| dynamic.commit());
                device.check();
                BuildTimes { binary: None, ready }
            }),
            trace: Box::new(move |work| {
                let dynamic = traced.borrow();
                let interfaces = embree_rays::interfaces(&dynamic.scene);
                let mut runs = interfaces.iter().filter_map(|interface| (interface.prepare)(work));
                runs.next().map(|mut run| run()).unwrap_or_default()
            }),
        }
    };
    [Quality::Refit, Quality::Low, Quality::Medium].map(updater).into()
}
