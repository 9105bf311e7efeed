//! Animations: clips of keys for nodes. What cannot be played is counted and left out, and the rest is played.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use gltf::accessor::DataType;
use serde_json::Value;

use super::accessor::{Accessor, AccessorError, Accessors, WRONG_TYPE};
use super::attributes::is_unit;
use super::document::{Document, Fault};
use super::nodes::Ordered;
use super::table::extension;
use crate::budget::Budget;
use crate::scene::assemble::BATCH_SIZE;
use crate::scene::error::{FileLocation, Warnings};
use crate::scene::motion::{Clip, Curve, Interpolation, Target, Track};
use crate::text::{counted, quoted};
use bvhscope_engine::cancel::{CancelToken, Cancelled};

/// Numbers in the keys of all clips; more are taken for a mistake or an attack: accessors that overlap can announce any number.
const MAX_NUMBERS: u64 = 1 << 26;

/// Bytes of a number while keys may be sorted.
const BYTES_PER_NUMBER: u64 = 2 * size_of::<f32>() as u64;

/// Kind of a fault: an index that points nowhere.
const NOTHING_NAMED: &str = "something named that does not exist";

/// The clips of a file.
#[derive(Default)]
pub(super) struct Animations {
    pub(super) curves: Vec<Curve>,
    pub(super) clips: Vec<Clip>,
    /// The tracks of each clip; those of a node are adjacent.
    pub(super) tracks: Vec<Vec<Track>>,
}

impl Animations {
    /// Places of the nodes that clips move.
    pub(super) fn moved_nodes(&self) -> HashSet<usize> {
        let is_move =
            |target: &Target| matches!(target, Target::Translation(_) | Target::Rotation(_) | Target::Scale(_));
        self.tracks.iter().flatten().map(|track| track.target).filter(is_move).map(Target::node).collect()
    }

    /// Whether a clip hides or shows nodes.
    pub(super) fn change_visibility(&self) -> bool {
        self.tracks.iter().flatten().any(|track| matches!(track.target, Target::Visibility(_)))
    }
}

/// A curve by the accessors it is read from: keys, values, numbers of a value and interpolation.
type CurveKey = (usize, usize, Option<usize>, Interpolation);

/// A property of a node as a channel names it.
#[derive(Clone, Copy, PartialEq)]
enum Property {
    Translation,
    Rotation,
    Scale,
    Weights,
    Visibility,
}

struct Reader<'a, 'b> {
    document: &'a Document<'a>,
    accessors: &'b Accessors<'a>,
    /// Place of each node of the scene in the order of the hierarchy.
    places: HashMap<usize, usize>,
    curves: Vec<Curve>,
    known: HashMap<CurveKey, usize>,
    /// Numbers read so far.
    numbers: u64,
    warnings: &'b mut Warnings,
    token: &'b CancelToken,
}

/// Reads the clips of a document, whose nodes are in `order`.
pub(super) fn read<'a>(
    document: &'a Document<'a>,
    accessors: &Accessors<'a>,
    order: &[Ordered],
    warnings: &mut Warnings,
    token: &CancelToken,
) -> Result<Animations, Cancelled> {
    let places = order.iter().enumerate().map(|(place, ordered)| (ordered.node, place)).collect();
    let (curves, known) = (Vec::new(), HashMap::new());
    let mut reader = Reader { document, accessors, places, curves, known, numbers: 0, warnings, token };
    let (mut clips, mut all_tracks) = (Vec::new(), Vec::new());
    for (index, animation) in document.animations.as_array().into_iter().flatten().enumerate() {
        token.check()?;
        let tracks = reader.tracks(index, animation)?;
        let spans = tracks.iter().map(|track| reader.curves[track.curve].span());
        let Some([start, end]) = spans.reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])]) else {
            let location = || FileLocation::Json(format!("animations[{index}]"));
            reader.warnings.add("clips without keys for the scene left out", location);
            continue;
        };
        let name = animation.get("name").and_then(Value::as_str).unwrap_or_default().to_owned();
        clips.push(Clip { name, start, end });
        all_tracks.push(tracks);
    }
    Ok(Animations { curves: reader.curves, clips, tracks: all_tracks })
}

impl<'a> Reader<'a, '_> {
    /// The tracks of one animation, ordered by their nodes.
    fn tracks(&mut self, index: usize, animation: &Value) -> Result<Vec<Track>, Cancelled> {
        let (mut tracks, mut targets) = (Vec::new(), HashSet::new());
        let channels = animation.get("channels").and_then(Value::as_array);
        for (k, channel) in channels.into_iter().flatten().enumerate() {
            self.token.check()?;
            let place = format!("animations[{index}].channels[{k}]");
            let fault = match self.track(channel, animation, &place) {
                Ok(Some(track)) if targets.insert(track.target) => {
                    tracks.push(track);
                    continue;
                }
                Ok(Some(_)) => Fault::new("another moves the same", ""),
                Ok(None) => continue,
                Err(AccessorError::Cancelled(cancelled)) => return Err(cancelled),
                Err(AccessorError::Unreadable(fault)) => fault,
            };
            let what = format!("channels of animations left out: {}", fault.kind);
            self.warnings.add(&what, || FileLocation::in_json(place, &fault.detail));
        }
        tracks.sort_by_key(|track| track.target.node());
        Ok(tracks)
    }

    /// The property that a channel moves, and how; `None` for one that no scene here has, which is counted.
    fn track(&mut self, channel: &Value, animation: &Value, place: &str) -> Result<Option<Track>, AccessorError> {
        let target = channel.get("target");
        let pointer =
            target.and_then(|target| target.get("extensions")?.get(extension::POINTER)?.get("pointer")?.as_str());
        let (node, property) = if let Some(pointer) = pointer {
            let Some(found) = pointed(pointer) else {
                let location = || FileLocation::in_json(place, quoted(pointer));
                self.warnings.add("properties that are animated not shown", location);
                return Ok(None);
            };
            found
        } else {
            let path = target.and_then(|target| target.get("path")?.as_str()).unwrap_or_default();
            let Some(node) = target.and_then(|target| index(target.get("node"))) else {
                return Err(Fault::new("no node is named", "").into());
            };
            let Some(property) = named(path) else {
                return Err(Fault::new("an unknown path", quoted(path)).into());
            };
            (node, property)
        };
        let Some(&place_of_node) = self.places.get(&node) else {
            let nodes = self.document.locals.len();
            return Err(if node < nodes {
                Fault::new("a node outside the scene", format!("nodes[{node}]")).into()
            } else {
                Fault::new(NOTHING_NAMED, format!("nodes[{node}] does not exist, there are {nodes}")).into()
            });
        };
        let samplers = animation.get("samplers").and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        let sampler = index(channel.get("sampler")).and_then(|sampler| samplers.get(sampler));
        let sampler =
            sampler.ok_or_else(|| Fault::new(NOTHING_NAMED, format!("its sampler, there are {}", samplers.len())))?;
        let curve = self.curve(sampler, property, place)?;
        if property == Property::Weights {
            let targets = self.document.gltf.nodes().nth(node).map_or(0, |node| morph_targets(&node));
            let width = self.curves[curve].width();
            if width != targets {
                let there_are = format!("{width} for {}", counted(targets as u64, "targets"));
                let location = || FileLocation::in_json(place, there_are);
                let what = "channels of animations with another number of weights than the mesh has morph targets";
                self.warnings.add(what, location);
            }
        }
        let target = match property {
            Property::Translation => Target::Translation(place_of_node),
            Property::Rotation => Target::Rotation(place_of_node),
            Property::Scale => Target::Scale(place_of_node),
            Property::Weights => Target::Weights(place_of_node),
            Property::Visibility => Target::Visibility(place_of_node),
        };
        Ok(Some(Track { target, curve }))
    }

    /// The curve of a sampler, which channels may share.
    fn curve(&mut self, sampler: &Value, property: Property, place: &str) -> Result<usize, AccessorError> {
        let interpolation = match sampler.get("interpolation").map(|word| word.as_str().unwrap_or_default()) {
            None | Some("LINEAR") => Interpolation::Linear,
            Some("STEP") => Interpolation::Step,
            Some("CUBICSPLINE") => Interpolation::Cubic,
            Some(word) => return Err(Fault::new("an unknown interpolation", quoted(word)).into()),
        };
        let accessor = |field: &str| {
            let count = self.document.gltf.accessors().len();
            // The last one stands for those that do not exist.
            let found = index(sampler.get(field)).filter(|&accessor| accessor < count.saturating_sub(1));
            found.ok_or_else(|| Fault::new(NOTHING_NAMED, format!("its {field}")))
        };
        let (input, output) = (accessor("input")?, accessor("output")?);
        let width = match property {
            Property::Translation | Property::Scale => Some(3),
            Property::Rotation => Some(4),
            Property::Visibility => Some(1),
            Property::Weights => None,
        };
        let interpolation = if property == Property::Visibility { Interpolation::Step } else { interpolation };
        let key = (input, output, width, interpolation);
        if let Some(&known) = self.known.get(&key) {
            return Ok(known);
        }
        let curve = self.read_curve(key, property, place)?;
        self.curves.push(curve);
        let index = self.curves.len().saturating_sub(1);
        self.known.insert(key, index);
        Ok(index)
    }

    fn open(&self, index: usize) -> Result<Accessor<'a>, AccessorError> {
        let json = self.document.gltf.accessors().nth(index);
        let json = json.ok_or_else(|| Fault::new(NOTHING_NAMED, format!("accessors[{index}]")))?;
        self.accessors.open(&json, self.token)
    }

    fn read_curve(
        &mut self,
        (input, output, width, interpolation): CurveKey,
        property: Property,
        place: &str,
    ) -> Result<Curve, AccessorError> {
        let (times, values) = (self.open(input)?, self.open(output)?);
        let is_value = match property {
            Property::Visibility => values.width == 1,
            Property::Weights => values.width == 1 && is_unit(&values),
            _ => Some(values.width) == width && is_unit(&values),
        };
        if times.width != 1 || times.component != DataType::F32 || !is_value {
            let wrong = if is_value { input } else { output };
            return Err(Fault::new(WRONG_TYPE, format!("accessors[{wrong}]")).into());
        }
        let parts = interpolation.values_per_key();
        // Of weights there are as many as morph targets.
        let width = width.unwrap_or_else(|| values.count.checked_div(times.count.saturating_mul(parts)).unwrap_or(0));
        let elements = if property == Property::Weights { width.saturating_mul(parts) } else { parts };
        let needed = times.count.saturating_mul(elements);
        if width == 0 || values.count < needed {
            let detail = format!("accessors[{output}]: {} for {} keys", values.count, times.count);
            return Err(Fault::new("fewer values than keys", detail).into());
        }
        if values.count > needed {
            let detail = format!("accessors[{output}]: {} for {} keys", values.count, times.count);
            self.warnings
                .add("channels of animations with more values than keys", || FileLocation::in_json(place, detail));
        }
        let numbers = (times.count as u64).saturating_mul((width.saturating_mul(parts) as u64).saturating_add(1));
        self.numbers = self.numbers.saturating_add(numbers);
        let bytes = numbers.saturating_mul(BYTES_PER_NUMBER);
        let within = Budget::of_process().check("the keys of a channel", bytes).map_err(|error| error.to_string());
        if let Some(detail) = within.err().or((self.numbers > MAX_NUMBERS).then(String::new)) {
            return Err(Fault::new("too many keys", detail).into());
        }
        self.gather(&times, &values, [elements, parts, width], interpolation, place)
    }

    /// Reads the keys, without those that are not numbers, and in order.
    fn gather(
        &mut self,
        times: &Accessor,
        values: &Accessor,
        [elements, parts, width]: [usize; 3],
        interpolation: Interpolation,
        place: &str,
    ) -> Result<Curve, AccessorError> {
        let mut keys: Vec<(f32, usize)> = Vec::with_capacity(times.count);
        let mut numbers = Vec::with_capacity(times.count.saturating_mul(parts.saturating_mul(width)));
        for key in 0..times.count {
            self.token.check_every(BATCH_SIZE / 16, key)?;
            let start = numbers.len();
            for element in 0..elements {
                let numbers_of: [f32; 4] = values.element(key.saturating_mul(elements).saturating_add(element));
                numbers.extend_from_slice(&numbers_of[..values.width.min(4)]);
            }
            let [time] = times.element(key);
            let of_key: &[f32] = numbers.get(start..).unwrap_or_default();
            if time.is_finite() && of_key.iter().all(|number| number.is_finite()) {
                keys.push((time, start));
            } else {
                numbers.truncate(start);
            }
        }
        let lost = times.count.saturating_sub(keys.len()) as u64;
        self.warnings.add_many(lost, "keys of animations that are not numbers left out", || {
            FileLocation::Json(place.to_owned())
        });
        if keys.is_empty() {
            return Err(Fault::new("no keys", "").into());
        }
        if !keys.is_sorted_by(|a, b| a.0 <= b.0) {
            self.warnings.add("channels of animations whose keys were out of order sorted", || {
                FileLocation::Json(place.to_owned())
            });
            keys.sort_by(|a, b| a.0.total_cmp(&b.0));
            let size = parts.saturating_mul(width);
            let of_key =
                |&(_, start): &(f32, usize)| numbers.get(start..start.saturating_add(size)).unwrap_or_default();
            numbers = keys.iter().flat_map(of_key).copied().collect();
        }
        let times: Arc<[f32]> = keys.into_iter().map(|(time, _)| time).collect();
        Ok(Curve::new(times, numbers, width, interpolation))
    }
}

/// Number of morph targets of a node's mesh.
pub(super) fn morph_targets(node: &gltf::Node) -> usize {
    let primitives = node.mesh().into_iter().flat_map(|mesh| mesh.primitives().collect::<Vec<_>>());
    primitives.map(|primitive| primitive.morph_targets().len()).max().unwrap_or(0)
}

/// The property that a channel's path names.
fn named(path: &str) -> Option<Property> {
    Some(match path {
        "translation" => Property::Translation,
        "rotation" => Property::Rotation,
        "scale" => Property::Scale,
        "weights" => Property::Weights,
        _ => return None,
    })
}

/// The node and the property that a pointer of KHR_animation_pointer names; `None` for what has no effect on triangles, or none here.
fn pointed(pointer: &str) -> Option<(usize, Property)> {
    let (node, property) = pointer.strip_prefix("/nodes/")?.split_once('/')?;
    let property = match property.strip_prefix("extensions/") {
        Some(property) => {
            (property.split_once('/')? == (extension::VISIBILITY, "visible")).then_some(Property::Visibility)
        }
        None => named(property),
    };
    Some((node.parse().ok()?, property?))
}

/// An index, which may be written as a float.
fn index(value: Option<&Value>) -> Option<usize> {
    let value = value?;
    let real = value.as_f64().filter(|number| number.fract() == 0.0 && (0.0..1e15).contains(number));
    value.as_u64().or(real.map(|number| number as u64)).and_then(|index| usize::try_from(index).ok())
}
