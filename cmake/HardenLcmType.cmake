# cmake -DHEADER=FILE -P HardenLcmType.cmake
# lcm-gen's decoders trust every count: they resize a vector to it before they look at how many bytes
# there are, and take a length of zero for a string. A damaged message then allocates gigabytes or
# throws through LCM's C code. No element is shorter than one byte, so both can be refused first.
# tests/convert/hostile_messages_test.cpp fails where a generator writes them differently.
file(READ ${HEADER} text)
string(REGEX REPLACE
  "this->([a-z_0-9]+)\\.resize\\(this->([a-z_0-9]+)\\);"
  "if(this->\\2 < 0 || this->\\2 > maxlen - pos) return -1;\n        this->\\1.resize(this->\\2);"
  text "${text}")
string(REGEX REPLACE
  "if\\((__[a-z_0-9]+) > maxlen - pos\\)" "if(\\1 < 1 || \\1 > maxlen - pos)" text "${text}")
file(WRITE ${HEADER} "${text}")
