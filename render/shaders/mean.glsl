// mean.glsl - fragment shader: a picture, pixel by pixel; blending makes the mean.
uniform sampler2D picture;
out vec4 color;

void main()
{
    color = texelFetch(picture, ivec2(gl_FragCoord.xy), 0);
}
