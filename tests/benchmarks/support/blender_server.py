"""A render server for Drake's clients within Blender, which does for each request what the one of Drake's authors does
(drake-blender): everything anew, Blender's empty scene, the glTF's import, the camera and the image's kind.

    blender --background --python blender_server.py -- SAMPLES
"""

import email.parser
import email.policy
import http.server
import math
import pathlib
import sys
import tempfile

import bpy
import numpy

# Its importer of glTF files wants a name that later versions of numpy no longer have.
numpy.bool = bool

WHITE = (1, 1, 1, 1)


def add_lamp():
    data = bpy.data.lights.new("lamp", "POINT")
    data.energy = 100
    lamp = bpy.data.objects.new("lamp", data)
    lamp.location = (0, 0, 5)
    bpy.context.collection.objects.link(lamp)


def import_file(path):
    """Drake sends z upwards, which the importer takes for y."""
    before = set(bpy.data.objects)
    bpy.ops.import_scene.gltf(filepath=str(path))
    bpy.ops.transform.rotate(
        value=math.pi / 2, orient_axis="X", orient_type="GLOBAL", center_override=(0, 0, 0)
    )
    return set(bpy.data.objects) - before


def set_camera(scene, form):
    width, height = int(form["width"]), int(form["height"])
    focal_x, focal_y = float(form["focal_x"]), float(form["focal_y"])
    scene.render.resolution_x, scene.render.resolution_y = width, height
    scene.render.resolution_percentage = 100
    scene.render.pixel_aspect_x = max(focal_y / focal_x, 1)
    scene.render.pixel_aspect_y = max(focal_x / focal_y, 1)
    camera = scene.camera = bpy.data.objects["Camera Node"]
    camera.data.clip_start, camera.data.clip_end = float(form["near"]), float(form["far"])
    camera.data.shift_x = 0.5 - float(form["center_x"]) / width
    camera.data.shift_y = (float(form["center_y"]) - 0.5 * height) / width
    camera.data.lens_unit = "FOV"
    camera.data.angle_y = float(form["fov_y"])


def show_color(scene):
    scene.render.image_settings.color_mode = "RGBA"


def show_values(scene):
    """Numbers as they are, of the middle of each pixel."""
    scene.view_settings.view_transform = "Raw"
    scene.render.filter_size = 0
    scene.render.dither_intensity = 0


def show_depth(scene, form):
    """Millimetres in 16 bits: 0 for what is too near, the largest number for what is too far."""
    least, most = float(form["min_depth"]), min(float(form["far"]), float(form["max_depth"]))
    scene.camera.data.clip_end = 1.001 * most
    scene.render.image_settings.color_mode = "BW"
    scene.render.image_settings.color_depth = "16"
    scene.use_nodes = True
    bpy.context.view_layer.use_pass_z = True
    tree = scene.node_tree
    tree.nodes.clear()

    def math_node(operation, *operands):
        node = tree.nodes.new("CompositorNodeMath")
        node.operation = operation
        for slot, operand in zip(node.inputs, operands):
            if isinstance(operand, (int, float)):
                slot.default_value = operand
            else:
                tree.links.new(operand, slot)
        return node.outputs[0]

    depth = tree.nodes.new("CompositorNodeRLayers").outputs["Depth"]
    seen = math_node("MULTIPLY", depth, math_node("GREATER_THAN", depth, least))
    shown = math_node("MAXIMUM", seen, math_node("MULTIPLY", math_node("GREATER_THAN", depth, most), 65.535))
    scaled = math_node("MULTIPLY", shown, 1000 / 65535)
    tree.links.new(math_node("MINIMUM", scaled, 1), tree.nodes.new("CompositorNodeComposite").inputs["Image"])


def show_labels(objects):
    """Everything in its base colour, unlit, before white."""
    bpy.data.worlds["World"].node_tree.nodes["Background"].inputs["Color"].default_value = WHITE
    for item in objects:
        if item.type != "MESH":
            continue
        material = item.data.materials[0]
        material.use_nodes = True
        tree = material.node_tree
        tree.nodes.clear()
        flat = tree.nodes.new("ShaderNodeBackground")
        flat.inputs["Color"].default_value = material.diffuse_color
        tree.links.new(flat.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])


def render(form, samples, folder):
    path = folder / "scene.gltf"
    path.write_bytes(form["scene"])
    bpy.ops.wm.read_factory_settings()
    for item in list(bpy.data.objects):
        bpy.data.objects.remove(item)
    add_lamp()
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples = samples
    scene.cycles.use_denoising = False
    objects = import_file(path)
    scene.render.image_settings.file_format = "PNG"
    scene.render.filepath = str(folder / "image.png")
    set_camera(scene, form)
    if form["image_type"] == "color":
        show_color(scene)
    else:
        show_values(scene)
    if form["image_type"] == "depth":
        show_depth(scene, form)
    if form["image_type"] == "label":
        show_labels(objects)
    bpy.ops.render.render(write_still=True)
    return (folder / "image.png").read_bytes()


def read_form(headers, body):
    head = f"Content-Type: {headers['Content-Type']}\r\n\r\n".encode()
    message = email.parser.BytesParser(policy=email.policy.HTTP).parsebytes(head + body)
    form = {}
    for part in message.iter_parts():
        name = part.get_param("name", header="Content-Disposition")
        content = part.get_payload(decode=True)
        form[name] = content if name == "scene" else content.decode().strip()
    return form


class Handler(http.server.BaseHTTPRequestHandler):
    protocol_version = "HTTP/1.1"

    def do_POST(self):
        form = read_form(self.headers, self.rfile.read(int(self.headers["Content-Length"])))
        image = render(form, self.server.samples, self.server.folder)
        self.send_response(200)
        self.send_header("Content-Type", "image/png")
        self.send_header("Content-Length", str(len(image)))
        self.end_headers()
        self.wfile.write(image)

    def log_message(self, *_):
        pass


def main():
    with tempfile.TemporaryDirectory(prefix="tessera-bench-blender-") as folder:
        with http.server.HTTPServer(("127.0.0.1", 0), Handler) as server:
            server.samples = int(sys.argv[sys.argv.index("--") + 1])
            server.folder = pathlib.Path(folder)
            print(f"\nlistening on {server.server_address[1]}", flush=True)
            server.serve_forever()


main()
