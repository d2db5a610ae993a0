"""Renders a Tessera scene document with Blender's Cycles; Blender runs it.

Usage: blender -b --factory-startup --python-exit-code 1 --python cycles_render.py -- ORDER

ORDER is a JSON file: {"scene": path, "width", "height", "max_depth", "threads",
"runs": [{"samples", "seed", "image": path of the EXR to write}, ...]}. For each run it prints "rendered in" and
processor seconds; the first one builds the scene as well. Files that the document names lie beside it, as binary PLY
files of float positions (and normals) and triangles. What this can't say in Blender's terms ends it with an error.
"""

import array
import json
import math
import pathlib
import sys
import time

import bpy
from mathutils import Matrix, Vector

SPHERE_RINGS = 64


class Meshes:
    """Blender's meshes of a document's shapes; a shape that several objects have is made once."""

    def __init__(self, folder):
        self.folder = folder

    def of(self, shape):
        kind = shape["type"]
        if kind == "file":
            return self.from_file(self.folder / shape["path"])
        if kind == "mesh":
            flat = [c for p in shape["positions"] for c in p]
            normals = [c for n in shape.get("normals", []) for c in n]
            return mesh_of(flat, [i for t in shape["triangles"] for i in t], normals)
        if kind == "quad":
            return mesh_of([c for p in shape["corners"] for c in p], [0, 1, 2, 0, 2, 3])
        if kind == "sphere":
            return sphere(Vector(shape["center"]), shape["radius"])
        raise SystemExit(f"cycles_render: no way to say the shape {kind}")

    def from_file(self, path):
        data = path.read_bytes()
        end = data.index(b"end_header\n") + len(b"end_header\n")
        header = data[:end].decode("ascii").split("\n")
        if header[1] != "format binary_little_endian 1.0":
            raise SystemExit(f"cycles_render: {path} isn't a binary PLY file")
        counts = {line.split()[1]: int(line.split()[2]) for line in header if line.startswith("element")}
        floats = sum(line.startswith("property float") for line in header)
        values = array.array("f", data[end : end + 4 * floats * counts["vertex"]])
        faces = data[end + 4 * floats * counts["vertex"] :]
        indices = array.array("I")
        for at in range(0, 13 * counts["face"], 13):  # each face: the number 3 in a byte, then its corners
            indices.frombytes(faces[at + 1 : at + 13])
        columns = [values[i::floats] for i in range(floats)]
        positions = [c for p in zip(*columns[:3]) for c in p]
        normals = [c for n in zip(*columns[3:6]) for c in n]
        return mesh_of(positions, indices, normals)


def mesh_of(positions, indices, normals=()):
    """A mesh of triangles; smooth where it has normals."""
    mesh = bpy.data.meshes.new("mesh")
    count = len(indices) // 3
    mesh.vertices.add(len(positions) // 3)
    mesh.vertices.foreach_set("co", positions)
    mesh.loops.add(3 * count)
    mesh.loops.foreach_set("vertex_index", indices)
    mesh.polygons.add(count)
    mesh.polygons.foreach_set("loop_start", range(0, 3 * count, 3))
    mesh.polygons.foreach_set("loop_total", [3] * count)
    mesh.polygons.foreach_set("use_smooth", [bool(normals)] * count)
    mesh.update(calc_edges=True)
    if mesh.validate():
        raise SystemExit("cycles_render: Blender would change a mesh")
    if normals:
        mesh.use_auto_smooth = True
        mesh.auto_smooth_angle = math.pi
        mesh.normals_split_custom_set_from_vertices([normals[i : i + 3] for i in range(0, len(normals), 3)])
    return mesh


def sphere(center, radius):
    """Cycles has no spheres: rings of triangles that hold the sphere's volume, with its normals."""
    rings, around = SPHERE_RINGS, 2 * SPHERE_RINGS
    directions = [Vector((0, 0, 1))]
    for i in range(1, rings):
        polar = math.pi * i / rings
        for j in range(around):
            azimuth = 2 * math.pi * j / around
            directions.append(
                Vector((math.sin(polar) * math.cos(azimuth), math.sin(polar) * math.sin(azimuth), math.cos(polar)))
            )
    directions.append(Vector((0, 0, -1)))
    last = len(directions) - 1
    triangles = []
    for j in range(around):
        k = (j + 1) % around
        triangles += [0, 1 + j, 1 + k, last, last - around + k, last - around + j]
        for i in range(rings - 2):
            low, high = 1 + i * around, 1 + (i + 1) * around
            triangles += [low + j, high + j, high + k, low + j, high + k, low + k]
    volume = 0
    for t in range(0, len(triangles), 3):
        a, b, c = (directions[i] for i in triangles[t : t + 3])
        volume += a.dot(b.cross(c)) / 6
    grown = radius * (4 / 3 * math.pi / volume) ** (1 / 3)
    return mesh_of(
        [c for d in directions for c in center + grown * d], triangles, [c for d in directions for c in d]
    )


def placement(transform):
    if transform is None:
        return Matrix.Identity(4)
    if isinstance(transform, list):
        rows = [transform[i : i + 4] for i in range(0, 12, 4)]
        return Matrix([*rows, (0, 0, 0, 1)])
    scale = transform.get("scale", 1)
    matrix = Matrix.Diagonal((*(scale if isinstance(scale, list) else [scale] * 3), 1))
    if "rotate" in transform:
        turn = transform["rotate"]
        matrix = Matrix.Rotation(math.radians(turn["degrees"]), 4, Vector(turn["axis"])) @ matrix
    return Matrix.Translation(transform.get("translate", (0, 0, 0))) @ matrix


class Surface:
    """The nodes of one material."""

    def __init__(self, name, material, shows_surface):
        self.material = bpy.data.materials.new(name)
        self.material.use_nodes = True
        self.tree = self.material.node_tree
        self.tree.nodes.clear()
        parts = self.scattering(material) if shows_surface else []
        if any(material.get("emission", [0])):
            parts.append(self.emission(material))
        self.output(parts)

    def node(self, kind, **inputs):
        node = self.tree.nodes.new("ShaderNode" + kind)
        for name, value in inputs.items():
            if name in ("distribution", "operation"):
                setattr(node, name, value)
            else:
                node.inputs[name].default_value = (*value, 1) if isinstance(value, list) else value
        return node

    def link(self, source, target):
        self.tree.links.new(source, target)

    def scattering(self, material):
        kind = material["type"]
        if kind == "diffuse":
            return self.diffuse(material["color"])
        if kind == "whitted":
            return self.diffuse(material["diffuse"]) + self.glossy(material.get("reflect", [0, 0, 0]), 0)
        if kind == "mirror":
            return self.glossy(material["color"], 0)
        if kind == "conductor" and "color" in material:
            return [self.metal(material["color"], material.get("roughness", 0))]
        if kind == "dielectric":
            return [self.glass(material)]
        if kind == "metallic_roughness":
            return [self.metallic_roughness(material)]
        raise SystemExit(f"cycles_render: no way to say the material {kind}")

    def diffuse(self, color):
        return [self.node("BsdfDiffuse", Color=color, Roughness=0).outputs[0]] if any(color) else []

    def glossy(self, color, roughness):
        if not any(color):
            return []
        distribution = "SHARP" if roughness == 0 else "GGX"
        return [self.node("BsdfGlossy", distribution=distribution, Color=color, Roughness=roughness).outputs[0]]

    def schlick(self):
        """(1 - |cos|)^5 of the angle between the viewer and the normal, as a socket."""
        geometry = self.node("NewGeometry")
        cosine = self.node("VectorMath", operation="DOT_PRODUCT")
        self.link(geometry.outputs["Incoming"], cosine.inputs[0])
        self.link(geometry.outputs["Normal"], cosine.inputs[1])
        absolute = self.node("Math", operation="ABSOLUTE")
        self.link(cosine.outputs["Value"], absolute.inputs[0])
        rest = self.node("Math", operation="SUBTRACT")
        rest.inputs[0].default_value = 1
        self.link(absolute.outputs[0], rest.inputs[1])
        power = self.node("Math", operation="POWER")
        self.link(rest.outputs[0], power.inputs[0])
        power.inputs[1].default_value = 5
        return power.outputs[0]

    def mix(self, factor, first, second):
        mix = self.node("MixShader")
        if isinstance(factor, float):
            mix.inputs[0].default_value = factor
        else:
            self.link(factor, mix.inputs[0])
        self.link(first, mix.inputs[1])
        self.link(second, mix.inputs[2])
        return mix.outputs[0]

    def metal(self, color, roughness):
        """Schlick's reflectance, which rises to 1 at grazing angles."""
        return self.mix(self.schlick(), self.glossy(color, roughness)[0], self.glossy([1, 1, 1], roughness)[0])

    def metallic_roughness(self, material):
        """glTF 2.0, appendix B: a metal, and a diffuse body under a dielectric coat of index 1.5."""
        color, roughness = material["base_color"], material.get("roughness", 1)
        metallic = float(material.get("metallic", 1))
        metal = self.metal(color, roughness) if metallic > 0 else None
        if metallic == 1:
            return metal
        fresnel = self.node("Math", operation="MULTIPLY_ADD")
        self.link(self.schlick(), fresnel.inputs[0])
        fresnel.inputs[1].default_value = 0.96
        fresnel.inputs[2].default_value = 0.04
        body = self.mix(fresnel.outputs[0], self.diffuse(color)[0], self.glossy([1, 1, 1], roughness)[0])
        return self.mix(metallic, body, metal) if metal else body

    def glass(self, material):
        """What passes is tinted; what is reflected isn't."""
        roughness, index = material.get("roughness", 0), material["ior"]
        distribution = "SHARP" if roughness == 0 else "GGX"
        color = material.get("color", [1, 1, 1])
        if color == [1, 1, 1]:
            return self.node(
                "BsdfGlass", distribution=distribution, Color=color, Roughness=roughness, IOR=index
            ).outputs[0]
        through = self.node(
            "BsdfRefraction", distribution=distribution, Color=color, Roughness=roughness, IOR=index
        ).outputs[0]
        fresnel = self.node("Fresnel", IOR=index).outputs[0]
        return self.mix(fresnel, through, self.glossy([1, 1, 1], roughness)[0])

    def emission(self, material):
        light = self.node("Emission", Color=material["emission"], Strength=1).outputs[0]
        if material.get("emits", "front") == "both":
            return light
        dark = self.node("Emission", Color=[0, 0, 0], Strength=0).outputs[0]
        return self.mix(self.node("NewGeometry").outputs["Backfacing"], light, dark)

    def output(self, parts):
        if not parts:
            return
        total = parts[0]
        for part in parts[1:]:
            add = self.node("AddShader")
            self.link(total, add.inputs[0])
            self.link(part, add.inputs[1])
            total = add.outputs[0]
        self.link(total, self.node("OutputMaterial").inputs["Surface"])


def add_objects(scene, document, folder, shows_surfaces):
    meshes = Meshes(folder)
    default = {"type": "diffuse", "color": [0.5, 0.5, 0.5]}
    surfaces = {
        name: Surface(name, material, shows_surfaces).material
        for name, material in {"": default, **document.get("materials", {})}.items()
    }
    shared = {}
    for shape in document["objects"]:
        surface = shape.get("material", "")
        key = (shape["of"] if shape["type"] == "instance" else len(shared), surface)
        if key not in shared:
            shared[key] = meshes.of(document["geometries"][shape["of"]] if shape["type"] == "instance" else shape)
            shared[key].materials.append(surfaces[surface])
        item = bpy.data.objects.new("object", shared[key])
        item.matrix_world = placement(shape.get("transform"))
        scene.collection.objects.link(item)


def add_lights(scene, document):
    world = scene.world = bpy.data.worlds.new("world")
    world.use_nodes = True
    background = world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value = (*document.get("background", [0, 0, 0]), 1)
    background.inputs["Strength"].default_value = 1
    for light in document.get("lights", []):
        kind = light["type"]
        if kind == "environment" and not {"path", "blob"} & light.keys():
            background.inputs["Color"].default_value = (*light["radiance"], 1)
        elif kind == "point":
            # Blender gives a point light's power, and lets it leave evenly in all directions.
            add_light(scene, "POINT", light["intensity"], 4 * math.pi).location = light["position"]
        elif kind == "sun":
            item = add_light(scene, "SUN", light["irradiance"], 1)
            item.data.angle = math.radians(light.get("angle", 0.53))
            item.rotation_mode = "QUATERNION"
            item.rotation_quaternion = Vector(light["direction"]).to_track_quat("-Z", "Y")
        else:
            raise SystemExit(f"cycles_render: no way to say the light {kind}")


def add_light(scene, kind, color, scale):
    data = bpy.data.lights.new("light", kind)
    strength = max(color)
    data.color = [c / strength for c in color]
    data.energy = strength * scale
    if kind == "POINT":
        data.shadow_soft_size = 0
    item = bpy.data.objects.new("light", data)
    scene.collection.objects.link(item)
    return item


def add_camera(scene, camera):
    """Blender's cameras look along -z, with y up."""
    if camera["type"] != "perspective":
        raise SystemExit(f"cycles_render: no way to say the camera {camera['type']}")
    data = bpy.data.cameras.new("camera")
    data.sensor_fit = "VERTICAL"
    data.angle = math.radians(camera["fov"])
    data.clip_start = camera.get("near", 1e-4)
    data.clip_end = camera.get("far", 1e6)
    if "lens" in camera:
        data.dof.use_dof = True
        data.dof.focus_distance = camera["lens"]["focus_distance"]
        data.dof.aperture_fstop = data.lens / 1000 / (2 * camera["lens"]["radius"])
    eye, at = Vector(camera["from"]), Vector(camera["at"])
    back = (eye - at).normalized()
    right = Vector(camera.get("up", (0, 1, 0))).cross(back).normalized()
    up = back.cross(right)
    item = bpy.data.objects.new("camera", data)
    item.matrix_world = Matrix.Translation(eye) @ Matrix((right, up, back)).transposed().to_4x4()
    scene.collection.objects.link(item)
    scene.camera = item


def choose_settings(scene, order):
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = order["width"], order["height"]
    scene.render.resolution_percentage = 100
    scene.render.threads_mode, scene.render.threads = "FIXED", order["threads"]
    scene.render.use_persistent_data = True
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_mode = "RGB"
    scene.render.image_settings.color_depth = "32"
    scene.render.image_settings.exr_codec = "NONE"
    scene.view_settings.view_transform = "Standard"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = False
    cycles.use_denoising = False
    cycles.pixel_filter_type = "BOX"
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.light_sampling_threshold = 0
    cycles.blur_glossy = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    # A path of two segments, direct light, is no bounce to Cycles.
    bounces = max(order["max_depth"] - 2, 0)
    for name in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "transparent_max_bounces"):
        setattr(cycles, name, bounces)


def main():
    order = json.loads(pathlib.Path(sys.argv[sys.argv.index("--") + 1]).read_text())
    path = pathlib.Path(order["scene"])
    document = json.loads(path.read_text())
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    scene = bpy.context.scene
    add_objects(scene, document, path.parent, order["max_depth"] > 1)
    add_lights(scene, document)
    add_camera(scene, document["camera"])
    choose_settings(scene, order)
    for run in order["runs"]:
        scene.cycles.samples = run["samples"]
        scene.cycles.seed = run["seed"]
        scene.render.filepath = run["image"]
        before = time.process_time()
        bpy.ops.render.render(write_still=True)
        print(f"\nrendered in {time.process_time() - before:.6f}", flush=True)


main()
