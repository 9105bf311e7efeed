//! The wgpu draw calls: the traced picture over the viewport and the lines over it, in the caller's render pass.

use std::sync::Arc;

use bvhscope_engine::tree::ContainerKind;

use crate::overlay::container_set::ContainerSet;
use crate::overlay::gpu::{Pipelines, bind_group, bind_group_layout};
use crate::overlay::highlight::highlighted;
use crate::overlay::input::DrawInput;
use crate::overlay::node::OverlayNode;
use crate::overlay::node_table::{NodeTable, Shown};
use crate::overlay::picture::{PictureTextures, size_of_texture};
use crate::overlay::settings::OverlaySettings;
use crate::overlay::uniforms::ViewUniforms;

/// Indices of a line segment: a quad of four vertices, drawn as two triangles.
const QUAD: [u16; 6] = [0, 1, 2, 2, 1, 3];
/// Maximum number of line segments of one instance: an outline and three great circles of 64 segments.
const MAX_PIECES: u32 = 4 * 64;
const BOX_EDGES: u32 = 12;
const BOX_FACES: u32 = 6;
const DOP_EDGES: u32 = 36;
/// Pieces of the six sides, three each, and of the eight cuts, two each.
const DOP_FACES: u32 = 6 * 3 + 8 * 2;

/// The inputs that the uploaded instances were made from.
#[derive(PartialEq)]
struct Key {
    table: u64,
    settings: OverlaySettings,
}

/// All GPU objects of the overlay; lives in egui's callback resources or in an offscreen renderer.
pub struct OverlayPipeline {
    format: wgpu::TextureFormat,
    layout: wgpu::BindGroupLayout,
    bind_group: wgpu::BindGroup,
    /// For pictures of the viewport's size, and for smaller ones.
    picture_pipelines: [wgpu::RenderPipeline; 2],
    /// In the order of [`ContainerKind::WITH_ORIENTED`], as all that is listed by kind.
    line_pipelines: [wgpu::RenderPipeline; 4],
    dot_pipeline: wgpu::RenderPipeline,
    /// The last draws pieces of any faces.
    face_pipelines: [wgpu::RenderPipeline; 5],
    uniforms: wgpu::Buffer,
    quads: wgpu::Buffer,
    sampler: wgpu::Sampler,
    picture: PictureTextures,
    /// True if the picture has fewer pixels than the viewport.
    smooth: bool,
    key: Option<(Key, Arc<Shown>)>,
    /// Nodes chosen by the settings, and how many of them are drawn with lines.
    shown: Instances,
    outlined: u32,
    /// Highlighted nodes, in a buffer of their own because they change with each movement of the pointer.
    marked: Instances,
    /// The overlap of the selected node's children, and which of the pipelines of faces draws it.
    overlap: Instances,
    overlap_faces: usize,
    /// For the shown and for the highlighted nodes the kinds of containers that are drawn.
    shown_kinds: ContainerSet,
    marked_kinds: ContainerSet,
    /// Circles drawn of each shown sphere: 1 for the outline alone, 4 with three great circles.
    shown_circles: u32,
    circle_segments: u32,
    /// True if faces are filled.
    faces: bool,
}

impl OverlayPipeline {
    /// Creates the pipelines for render targets of `format`.
    pub fn new(device: &wgpu::Device, format: wgpu::TextureFormat) -> Self {
        let layout = bind_group_layout(device);
        let pipelines = Pipelines::new(device, format, &layout);
        let uniforms = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("overlay view"),
            size: size_of::<ViewUniforms>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let indices: Vec<u16> =
            (0..MAX_PIECES as u16).flat_map(|piece| QUAD.map(|corner| piece * 4 + corner)).collect();
        let quads = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("overlay quads"),
            size: size_of_val(&indices[..]) as u64,
            usage: wgpu::BufferUsages::INDEX | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: true,
        });
        if let Ok(mut mapped) = quads.get_mapped_range_mut(..) {
            mapped.copy_from_slice(bytemuck::cast_slice(&indices));
        }
        quads.unmap();
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("overlay picture"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        let picture = PictureTextures::placeholder(device);
        let bind_group = bind_group(device, &layout, &uniforms, &picture, &sampler);
        Self {
            format,
            layout,
            bind_group,
            picture_pipelines: pipelines.pictures,
            smooth: false,
            line_pipelines: pipelines.lines,
            dot_pipeline: pipelines.dots,
            face_pipelines: pipelines.faces,
            uniforms,
            quads,
            sampler,
            picture,
            key: None,
            shown: Instances::default(),
            outlined: 0,
            marked: Instances::default(),
            overlap: Instances::default(),
            overlap_faces: 0,
            shown_kinds: ContainerSet::NONE,
            marked_kinds: ContainerSet::NONE,
            shown_circles: 4,
            circle_segments: 64,
            faces: false,
        }
    }

    /// The format of the render targets that it draws to.
    pub const fn format(&self) -> wgpu::TextureFormat {
        self.format
    }

    /// Uploads what changed since the last draw: the picture if its id is new, the instances if table, settings or the list of
    /// shown nodes changed, and the uniforms.
    pub fn prepare(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, input: &DrawInput<'_>) {
        if self.picture.upload(device, queue, &input.picture) {
            self.bind_group = bind_group(device, &self.layout, &self.uniforms, &self.picture, &self.sampler);
        }
        self.smooth = size_of_texture(&self.picture.color) != [input.viewport_px[2], input.viewport_px[3]];
        if let Some(table) = input.table {
            self.upload_instances(device, queue, table, input);
        } else {
            (self.shown.count, self.marked.count, self.outlined, self.key) = (0, 0, 0, None);
            self.overlap.count = 0;
        }
        let view = ViewUniforms::new(input, self.circle_segments);
        queue.write_buffer(&self.uniforms, 0, bytemuck::bytes_of(&view));
    }

    /// Records the draw calls into `pass`, whose viewport must be the rectangle given to [`OverlayPipeline::prepare`].
    pub fn paint(&self, pass: &mut wgpu::RenderPass<'static>) {
        pass.set_bind_group(0, &self.bind_group, &[]);
        pass.set_pipeline(&self.picture_pipelines[usize::from(self.smooth)]);
        pass.draw(0..3, 0..1);
        pass.set_index_buffer(self.quads.slice(..), wgpu::IndexFormat::Uint16);
        let whole = |instances: &Instances| 0..instances.count;
        let lists = [
            (&self.shown, 0..self.outlined, self.shown_kinds, self.shown_circles),
            (&self.marked, whole(&self.marked), self.marked_kinds, 4),
        ];
        if self.outlined < self.shown.count
            && let Some(buffer) = &self.shown.buffer
        {
            pass.set_vertex_buffer(0, buffer.slice(..));
            pass.set_pipeline(&self.dot_pipeline);
            pass.draw_indexed(0..QUAD.len() as u32, 0, self.outlined..self.shown.count);
        }
        if self.faces {
            self.paint_faces(pass);
        }
        self.paint_overlap(pass);
        for (instances, range, kinds, circles) in lists {
            let Some(buffer) = instances.buffer.as_ref().filter(|_| !range.is_empty()) else { continue };
            pass.set_vertex_buffer(0, buffer.slice(..));
            let pieces = [BOX_EDGES, circles * self.circle_segments, DOP_EDGES, BOX_EDGES];
            for kind in kinds.iter().map(|kind| kind as usize) {
                pass.set_pipeline(&self.line_pipelines[kind]);
                pass.draw_indexed(0..pieces[kind] * QUAD.len() as u32, 0, range.clone());
            }
        }
    }

    /// Fills the faces of the containers that are drawn with lines.
    fn paint_faces(&self, pass: &mut wgpu::RenderPass<'static>) {
        let Some(buffer) = self.shown.buffer.as_ref().filter(|_| self.outlined > 0) else { return };
        pass.set_vertex_buffer(0, buffer.slice(..));
        let pieces = self.face_pieces();
        for kind in self.shown_kinds.iter().map(|kind| kind as usize) {
            pass.set_pipeline(&self.face_pipelines[kind]);
            pass.draw_indexed(0..pieces[kind] * QUAD.len() as u32, 0, 0..self.outlined);
        }
    }

    /// Pieces of an instance that each pipeline of faces draws.
    const fn face_pieces(&self) -> [u32; 5] {
        [BOX_FACES, self.circle_segments, DOP_FACES, BOX_FACES, 1]
    }

    /// Fills what the children of the selected node have in common.
    fn paint_overlap(&self, pass: &mut wgpu::RenderPass<'static>) {
        let Some(buffer) = self.overlap.buffer.as_ref().filter(|_| self.overlap.count > 0) else { return };
        let pieces = self.face_pieces()[self.overlap_faces];
        pass.set_vertex_buffer(0, buffer.slice(..));
        pass.set_pipeline(&self.face_pipelines[self.overlap_faces]);
        pass.draw_indexed(0..pieces * QUAD.len() as u32, 0, 0..self.overlap.count);
    }

    fn upload_instances(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        table: &NodeTable,
        input: &DrawInput<'_>,
    ) {
        self.shown_kinds = input.settings.kinds(table.container_kind());
        self.faces = input.settings.faces;
        let own = ContainerSet::of(table.container_kind());
        self.marked_kinds = if self.shown_kinds.is_empty() { own } else { self.shown_kinds };
        // Settings that only the uniforms read must not trigger a new list of instances.
        let settings =
            OverlaySettings { hidden_alpha: 0.0, line_width: 1.0, faces: false, overlap: false, ..input.settings }
                .with_kinds(self.marked_kinds);
        let marked: Vec<OverlayNode> = highlighted(table, input.selection)
            .into_iter()
            .map(|(node, role)| {
                let mut instance = table.instance(node, table.depth(node), &settings);
                instance.flags |= (role as u32) << 8;
                instance
            })
            .collect();
        self.marked.upload(device, queue, &marked);
        let selected = input.selection.selected.filter(|&node| input.settings.overlap && (node as usize) < table.len());
        let overlap = selected.map_or_else(Vec::new, |node| table.overlap_instances(node));
        self.overlap.upload(device, queue, &overlap);
        self.overlap_faces = match table.container_kind() {
            // Two of them have a polyhedron in common, not a box.
            ContainerKind::Oriented => self.face_pipelines.len() - 1,
            own => own as usize,
        };
        if self.shown_kinds.is_empty() {
            (self.shown.count, self.outlined, self.key) = (0, 0, None);
            return;
        }

        let key = Key { table: table.id, settings };
        if self.key.as_ref().is_some_and(|(known, shown)| *known == key && Arc::ptr_eq(shown, input.shown)) {
            return;
        }
        let mut instances = table.instances(input.shown, &settings);
        instances.truncate(device.limits().max_buffer_size as usize / size_of::<OverlayNode>());
        self.shown.upload(device, queue, &instances);
        self.outlined = self.shown.count.min(input.shown.outlined as u32);
        // Many spheres with great circles are neither legible nor fast to draw.
        (self.shown_circles, self.circle_segments) = match self.outlined {
            0..=64 => (4, 64),
            65..=512 => (4, 48),
            _ => (1, 32),
        };
        self.key = Some((key, Arc::clone(input.shown)));
    }
}

/// Instances in a vertex buffer that grows on demand.
#[derive(Default)]
struct Instances {
    buffer: Option<wgpu::Buffer>,
    count: u32,
}

impl Instances {
    fn upload(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, nodes: &[OverlayNode]) {
        self.count = nodes.len() as u32;
        let bytes: &[u8] = bytemuck::cast_slice(nodes);
        if bytes.is_empty() {
            return;
        }
        let held = self.buffer.take().filter(|buffer| buffer.size() >= bytes.len() as u64);
        let buffer = held.unwrap_or_else(|| {
            device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("overlay instances"),
                size: bytes.len() as u64,
                usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        });
        queue.write_buffer(&buffer, 0, bytes);
        self.buffer = Some(buffer);
    }
}
