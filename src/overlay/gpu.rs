//! The wgpu objects of the overlay that are made once: bind group and render pipelines.

use crate::overlay::node::OverlayNode;
use crate::overlay::picture::PictureTextures;
use crate::overlay::shaders;

/// Layout of bind group 0, which all drawables share.
pub(super) fn bind_group_layout(device: &wgpu::Device) -> wgpu::BindGroupLayout {
    let texture = |binding, filterable| wgpu::BindGroupLayoutEntry {
        binding,
        visibility: wgpu::ShaderStages::FRAGMENT,
        ty: wgpu::BindingType::Texture {
            sample_type: wgpu::TextureSampleType::Float { filterable },
            view_dimension: wgpu::TextureViewDimension::D2,
            multisampled: false,
        },
        count: None,
    };
    device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("overlay"),
        entries: &[
            wgpu::BindGroupLayoutEntry {
                binding: 0,
                visibility: wgpu::ShaderStages::VERTEX_FRAGMENT,
                ty: wgpu::BindingType::Buffer {
                    ty: wgpu::BufferBindingType::Uniform,
                    has_dynamic_offset: false,
                    min_binding_size: None,
                },
                count: None,
            },
            texture(1, false),
            texture(2, true),
            wgpu::BindGroupLayoutEntry {
                binding: 3,
                visibility: wgpu::ShaderStages::FRAGMENT,
                ty: wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
                count: None,
            },
        ],
    })
}

/// Group 0 with the current picture.
pub(super) fn bind_group(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    uniforms: &wgpu::Buffer,
    picture: &PictureTextures,
    sampler: &wgpu::Sampler,
) -> wgpu::BindGroup {
    let [depth, color] =
        [&picture.depth, &picture.color].map(|texture| texture.create_view(&wgpu::TextureViewDescriptor::default()));
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("overlay"),
        layout,
        entries: &[
            wgpu::BindGroupEntry { binding: 0, resource: uniforms.as_entire_binding() },
            wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&depth) },
            wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::TextureView(&color) },
            wgpu::BindGroupEntry { binding: 3, resource: wgpu::BindingResource::Sampler(sampler) },
        ],
    })
}

/// Render pipelines of the drawables; the picture has two: one for pictures of the viewport's size, one for smaller ones.
pub(super) struct Pipelines {
    pub(super) pictures: [wgpu::RenderPipeline; 2],
    /// Lines of boxes, spheres, polytopes and oriented boxes.
    pub(super) lines: [wgpu::RenderPipeline; 4],
    pub(super) dots: wgpu::RenderPipeline,
    /// Faces of boxes, spheres, polytopes and oriented boxes, and pieces of any faces.
    pub(super) faces: [wgpu::RenderPipeline; 5],
}

impl Pipelines {
    #[expect(clippy::too_many_lines, reason = "a list of pipelines and buffers")]
    pub(super) fn new(device: &wgpu::Device, format: wgpu::TextureFormat, group: &wgpu::BindGroupLayout) -> Self {
        let layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("overlay"),
            bind_group_layouts: &[Some(group)],
            immediate_size: 0,
        });
        // The memory layout of `OverlayNode`, with the locations of `Node` in line.wgsl.
        let attributes = wgpu::vertex_attr_array![
            0 => Float32x3, 1 => Uint32, 2 => Float32x3, 3 => Float32, 4 => Float32x4,
            5 => Uint32, 6 => Uint32, 7 => Float32x4, 8 => Float32x4,
            9 => Float32x3, 10 => Float32x3, 11 => Float32x3, 12 => Float32x3
        ];
        let nodes = wgpu::VertexBufferLayout {
            array_stride: size_of::<OverlayNode>() as u64,
            step_mode: wgpu::VertexStepMode::Instance,
            attributes: &attributes,
        };
        let linear = ("LINEAR_TARGET", f64::from(u8::from(format.is_srgb())));
        let pipeline = |label,
                        source: &str,
                        [vertex, fragment]: [&str; 2],
                        constants: &[(&str, f64)],
                        blend,
                        buffers: &[Option<wgpu::VertexBufferLayout<'_>>]| {
            let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
                label: Some(label),
                source: wgpu::ShaderSource::Wgsl(source.into()),
            });
            device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
                label: Some(label),
                layout: Some(&layout),
                vertex: wgpu::VertexState {
                    module: &module,
                    entry_point: Some(vertex),
                    compilation_options: wgpu::PipelineCompilationOptions::default(),
                    buffers,
                },
                primitive: wgpu::PrimitiveState::default(),
                depth_stencil: None,
                multisample: wgpu::MultisampleState::default(),
                fragment: Some(wgpu::FragmentState {
                    module: &module,
                    entry_point: Some(fragment),
                    compilation_options: wgpu::PipelineCompilationOptions { constants, ..Default::default() },
                    targets: &[Some(wgpu::ColorTargetState { format, blend, write_mask: wgpu::ColorWrites::ALL })],
                }),
                multiview_mask: None,
                cache: None,
            })
        };
        let [picture, boxes, spheres, dops, oriented, dots, faces @ ..] = shaders::sources();
        let over = Some(wgpu::BlendState::PREMULTIPLIED_ALPHA_BLENDING);
        let nodes = &[Some(nodes)];
        let picture_pipeline = |smooth| {
            let constants = [linear, ("SMOOTH", smooth)];
            pipeline("overlay picture", &picture, ["vs_picture", "fs_picture"], &constants, None, &[])
        };
        let [of_boxes, of_spheres, of_dops, of_oriented, of_polygons] = faces;
        let faces = [
            (of_boxes, "vs_box_face"),
            (of_spheres, "vs_sphere_face"),
            (of_dops, "vs_dop_face"),
            (of_oriented, "vs_oriented_face"),
            (of_polygons, "vs_polygon_face"),
        ]
        .map(|(source, vertex)| pipeline("overlay faces", &source, [vertex, "fs_face"], &[linear], over, nodes));
        Self {
            pictures: [picture_pipeline(0.0), picture_pipeline(1.0)],
            lines: [
                pipeline("overlay boxes", &boxes, ["vs_box", "fs_line"], &[linear], over, nodes),
                pipeline("overlay spheres", &spheres, ["vs_sphere", "fs_line"], &[linear], over, nodes),
                pipeline("overlay polytopes", &dops, ["vs_dop", "fs_line"], &[linear], over, nodes),
                pipeline("overlay oriented boxes", &oriented, ["vs_oriented", "fs_line"], &[linear], over, nodes),
            ],
            dots: pipeline("overlay dots", &dots, ["vs_dot", "fs_line"], &[linear], over, nodes),
            faces,
        }
    }
}
