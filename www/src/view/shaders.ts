// The view's shaders (WebGL 2).
export const MESH_VERTEX = `#version 300 es
layout(location=0) in vec3 position;
layout(location=1) in vec3 normal;
layout(location=2) in vec4 attributes;
uniform mat4 clipFromWorld;
uniform vec3 eye;
out vec3 vNormal;
out vec3 vColor;
out float vDistance;
flat out int vClass;
void main() {
  gl_Position = clipFromWorld * vec4(position, 1.0);
  vNormal = normal;
  vColor = attributes.rgb;
  vDistance = distance(position, eye);
  vClass = int(attributes.a * 255.0 + 0.5);
}`;

export const MESH_FRAGMENT = `#version 300 es
precision highp float;
precision highp int;
in vec3 vNormal;
in vec3 vColor;
in float vDistance;
flat in int vClass;
uniform sampler2D classes;   // colour, and in alpha whether it is shown
uniform int shading;
uniform int highlight;       // class, or -1
uniform vec3 light;
uniform float reach;
uniform bool picking;
out vec4 result;
vec3 ramp(float t) {
  vec3 a = vec3(0.99, 0.95, 0.75), b = vec3(0.69, 0.81, 0.36), c = vec3(0.18, 0.62, 0.52);
  vec3 d = vec3(0.11, 0.36, 0.52), e = vec3(0.09, 0.11, 0.29);
  t = clamp(t, 0.0, 1.0) * 4.0;
  return t < 1.0 ? mix(a, b, t) : t < 2.0 ? mix(b, c, t - 1.0)
       : t < 3.0 ? mix(c, d, t - 2.0) : mix(d, e, t - 3.0);
}
void main() {
  vec4 entry = texelFetch(classes, ivec2(vClass, 0), 0);
  if (entry.a < 0.5) discard;
  if (picking) {
    uint depth = uint(gl_FragCoord.z * 16777215.0);
    result = vec4(float(vClass), float(depth >> 16), float((depth >> 8) & 255u), float(depth & 255u)) / 255.0;
    return;
  }
  vec3 n = normalize(vNormal);
  float shade = 0.72 + 0.28 * dot(n, light);
  vec3 color = vColor;
  if (shading == 1) color = entry.rgb * shade;
  if (shading == 2) color = n * 0.5 + 0.5;
  if (shading == 3) color = ramp(vDistance / reach) * (0.85 + 0.15 * shade);
  if (highlight >= 0) {
    if (vClass == highlight) color = mix(color, entry.rgb, 0.35) * 1.15;
    else color = mix(vec3(dot(color, vec3(0.3, 0.59, 0.11))), color, 0.15) * 0.45;
  }
  result = vec4(color, 1.0);
}`;

// A segment is a quad, as wide as it should be in pixels: lines have a width of one everywhere.
export const LINE_VERTEX = `#version 300 es
layout(location=0) in vec3 from;
layout(location=1) in vec3 to;
uniform mat4 clipFromWorld;
uniform vec2 viewport;
uniform float width;
void main() {
  vec4 a = clipFromWorld * vec4(from, 1.0), b = clipFromWorld * vec4(to, 1.0);
  const float NEAR = 0.02;
  if (a.w < NEAR) a = mix(a, b, (NEAR - a.w) / max(b.w - a.w, 1e-6));
  if (b.w < NEAR) b = mix(b, a, (NEAR - b.w) / max(a.w - b.w, 1e-6));
  vec2 direction = (b.xy / b.w - a.xy / a.w) * viewport;
  direction = length(direction) > 1e-6 ? normalize(direction) : vec2(1.0, 0.0);
  vec4 end = gl_VertexID < 2 ? a : b;
  float side = (gl_VertexID & 1) == 0 ? 1.0 : -1.0;
  end.xy += vec2(-direction.y, direction.x) * side * width / viewport * end.w;
  gl_Position = end;
}`;
export const LINE_FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 color;
out vec4 result;
void main() { result = color; }`;
