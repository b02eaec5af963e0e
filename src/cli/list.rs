//! `list`: what there is.

use super::{Listed, parameters, print};
use crate::gpu;
use crate::lessons;
use crate::scene::builtin;
use crate::scene::builtin::cases::CASES;
use crate::{techniques, view};
use anyhow::Result;

pub fn list(what: Listed, json: bool) -> Result<()> {
    let pairs = |rows: Vec<(String, String)>| {
        let width = rows.iter().map(|r| r.0.len()).max().unwrap_or(0);
        rows.iter().map(|(a, b)| format!("{a:<width$}  {b}\n")).collect::<String>()
    };
    let (value, text) = match what {
        Listed::Scenes => {
            let value = builtin::SCENES.iter().map(|b| {
                serde_json::json!({
                    "name": b.name, "description": b.description, "triangles": b.triangles, "cameras": b.cameras, "lights": b.lights,
                })
            });
            let text = builtin::SCENES.iter().map(|b| {
                format!(
                    "{:<12} {} triangles. {}\n{:12} cameras: {}\n{:12} lights: {}\n",
                    b.name,
                    b.triangles,
                    b.description,
                    "",
                    b.cameras.join(", "),
                    "",
                    b.lights.join(", ")
                )
            });
            (value.collect(), text.collect())
        }
        Listed::Cases => {
            let value =
                CASES.iter().map(|c| serde_json::json!({"id": c.id, "axis": c.axis, "frames": c.frames, "doc": c.doc, "provokes": c.provokes}));
            let text = CASES.iter().map(|c| (c.id.to_string(), format!("{}. {}", c.axis, c.doc)));
            (value.collect(), pairs(text.collect()))
        }
        Listed::Techniques => {
            let value = techniques::ALL.iter().map(|i| {
                let params = i.specs().map(|s| {
                    serde_json::json!({"name": s.name, "default": s.default(), "range": s.range(), "unit": s.unit, "doc": s.doc.trim()})
                });
                serde_json::json!({
                    "id": i.id, "title": i.title, "paper": i.paper, "doc": i.doc, "lights": i.lights,
                    "filters": i.filters(&Default::default()),
                    "maps": i.all_views().map(|m| m.id).collect::<Vec<_>>(), "params": params.collect::<Vec<_>>(),
                })
            });
            let text = techniques::ALL.iter().map(|i| {
                let params =
                    i.specs().map(|s| format!("    {} = {}: {}. {}\n", s.name, s.default(), s.range(), s.doc.trim()));
                format!(
                    "{}: {} ({}); {} light\n{}",
                    i.id,
                    i.title,
                    i.paper,
                    i.lights.join(", "),
                    params.collect::<String>()
                )
            });
            (value.collect(), text.collect())
        }
        Listed::Views => {
            let own = techniques::ALL.iter().flat_map(|i| i.all_views().map(move |m| (m, Some(i.id))));
            let rows: Vec<_> = view::VIEWS.iter().map(|v| (v, None)).chain(own).collect();
            let value = rows.iter().map(|(v, of)| serde_json::json!({"id": v.id, "doc": v.doc, "technique": of}));
            let text = rows.iter().map(|(v, of)| match of {
                Some(id) => (v.id.to_string(), format!("{} ({id})", v.doc)),
                None => (v.id.to_string(), v.doc.to_string()),
            });
            (value.collect(), pairs(text.collect()))
        }
        Listed::Parameters => {
            let value = techniques::ALL.iter().flat_map(|i| i.specs().map(move |s| {
                serde_json::json!({"technique": i.id, "name": s.name, "default": s.default(), "range": s.range(), "doc": s.doc.trim()})
            }));
            (value.collect(), parameters::page())
        }
        Listed::Lessons => {
            let value = lessons::all().iter().map(|l| {
                let steps: Vec<&str> = l.steps.iter().map(|s| s.title.as_str()).collect();
                serde_json::json!({"id": l.id, "title": l.title, "see": l.see, "steps": steps})
            });
            let text = lessons::all().iter().map(|l| (l.id.clone(), format!("{}: {} steps", l.title, l.steps.len())));
            (value.collect(), pairs(text.collect()))
        }
        Listed::Adapters => {
            let all: Vec<_> = gpu::found(&gpu::instance())?.iter().map(|a| a.get_info()).collect();
            let value = all.iter().map(|i| {
                serde_json::json!({"name": i.name, "backend": i.backend.to_str(), "driver": i.driver_info,
                    "software": i.device_type == wgpu::DeviceType::Cpu})
            });
            let text =
                all.iter().map(|i| (i.name.clone(), format!("{} {:?} {}", i.backend, i.device_type, i.driver_info)));
            (value.collect(), pairs(text.collect()))
        }
    };
    let value: serde_json::Value = value;
    print(&if json { serde_json::to_string_pretty(&value)? + "\n" } else { text })
}
